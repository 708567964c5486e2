/** A table whose rows become cards where the pane is too narrow for columns (`.folding` in app.css): each cell gets the name of its
 * column, which it shows then. */
export function folding(table: HTMLTableElement): { destroy: () => void } {
  const name = () => {
    const columns = [...(table.tHead?.rows[0]?.cells ?? [])].map((cell) => cell.textContent.trim());
    for (const row of table.tBodies[0]?.rows ?? [])
      [...row.cells].forEach((cell, index) => {
        const column = columns[index] ?? "";
        if (cell.dataset["column"] !== column) cell.dataset["column"] = column;
      });
  };
  const observer = new MutationObserver(name);
  table.classList.add("folding");
  name();
  for (const part of [table.tHead, ...table.tBodies]) {
    const isHead = part === table.tHead;
    if (part) observer.observe(part, { childList: true, characterData: isHead, subtree: isHead });
  }
  return { destroy: () => observer.disconnect() };
}
