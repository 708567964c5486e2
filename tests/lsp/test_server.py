"""`steptwin lsp` as a process, asked by an independent client (pytest-lsp) over its standard input and output."""

from __future__ import annotations

import asyncio
import contextlib
import json
import subprocess
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
import pytest_lsp
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcInvalidParams
from pytest_lsp import ClientServerConfig, LanguageClient, client_capabilities
from tests.lsp.conftest import BROKEN, BROKEN_CHIP, CHIP, CONFIG, PROGRAM, TABLE, WORLD

from steptwin.diagnostics import Diagnostic, Severity, Span
from steptwin.lsp.editorserver import most_severe
from steptwin.lsp.files import NoFiles
from steptwin.lsp.server import server

COMMAND = [sys.executable, "-m", "steptwin", "lsp"]


@pytest_lsp.fixture(config=ClientServerConfig(server_command=COMMAND))
async def client(lsp_client: LanguageClient) -> AsyncIterator[None]:
    @lsp_client.feature(lsp.CLIENT_REGISTER_CAPABILITY)
    def register(params: lsp.RegistrationParams) -> None:
        assert [one.method for one in params.registrations] == [lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES]

    capabilities = client_capabilities("visual-studio-code")
    await lsp_client.initialize_session(lsp.InitializeParams(capabilities=capabilities))
    yield
    await lsp_client.shutdown_session()


def open_text(client: LanguageClient, uri: str, text: str, language: str = "") -> None:
    client.text_document_did_open(lsp.DidOpenTextDocumentParams(lsp.TextDocumentItem(uri, language, 1, text)))


async def diagnostics(client: LanguageClient, uri: str) -> list[str]:
    """The codes that are pushed next for a text."""
    while True:
        await asyncio.wait_for(client.wait_for_notification(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS), 60)
        if uri in client.diagnostics:
            return [str(found.code) for found in client.diagnostics.pop(uri)]


def position(text: str, mark: str, part: str) -> lsp.Position:
    """Of a part of the first line with a mark, in UTF-16."""
    before = text[: text.index(mark) + mark.index(part)]
    line = before.count("\n")
    return lsp.Position(line, len(before.rpartition("\n")[2].encode("utf-16-le")) // 2)


@pytest.fixture
def controller(tmp_path: Path) -> str:
    """The address of a program with its table and configuration on the disk."""
    (tmp_path / "machine.csv").write_text(TABLE)
    (tmp_path / "machine.cfg").write_bytes(CONFIG.encode("utf-16"))
    return (tmp_path / "machine.prg").as_uri()


def test_of_very_many_findings_the_most_severe_are_sent() -> None:
    def finding(number: int) -> Diagnostic:
        severity = Severity.ERROR if number % 2 else Severity.WARNING
        return Diagnostic(f"X{number}", severity, Span(number, number + 1), "wrong")

    few, many = [finding(number) for number in range(1000)], [finding(number) for number in range(1500)]
    assert most_severe(few) == few
    *shown, last = most_severe(many)
    assert [found.span.start for found in shown] == sorted([*range(1, 1500, 2), *range(0, 500, 2)])
    assert (last.span.start, last.message) == (500, "1500 findings: the 1000 most severe are shown")


@pytest.mark.asyncio
async def test_very_many_findings_are_not_sent(client: LanguageClient, tmp_path: Path) -> None:
    uri = (tmp_path / "chip.m1486").as_uri()
    open_text(client, uri, "R" * 1200)
    found = await diagnostics(client, uri)
    assert (len(found), found.count("S002")) == (1001, 1)


@pytest.mark.asyncio
async def test_diagnostics_follow_what_is_typed(client: LanguageClient, controller: str) -> None:
    open_text(client, controller, PROGRAM)
    assert await diagnostics(client, controller) == []
    place = position(PROGRAM, "JUMP PICK", "PICK")
    change = lsp.TextDocumentContentChangePartial(lsp.Range(place, lsp.Position(place.line, place.character + 4)), "PIKC")
    identifier = lsp.VersionedTextDocumentIdentifier(2, controller)
    client.text_document_did_change(lsp.DidChangeTextDocumentParams(identifier, [change]))
    assert "W110" in await diagnostics(client, controller)
    found = await client.text_document_code_action_async(
        lsp.CodeActionParams(
            lsp.TextDocumentIdentifier(controller),
            lsp.Range(place, place),
            lsp.CodeActionContext([], only=[lsp.CodeActionKind.QuickFix]),
        )
    )
    assert found is not None
    (action,) = found
    assert isinstance(action, lsp.CodeAction)
    assert action.edit is not None
    assert action.edit.changes is not None
    (edit,) = action.edit.changes[controller]
    assert edit.new_text == "PICK"
    assert edit.range == change.range
    client.text_document_did_close(lsp.DidCloseTextDocumentParams(lsp.TextDocumentIdentifier(controller)))
    assert await diagnostics(client, controller) == []


@pytest.mark.asyncio
async def test_questions_about_places(client: LanguageClient, controller: str) -> None:
    open_text(client, controller, PROGRAM)
    text = lsp.TextDocumentIdentifier(controller)
    hover = await client.text_document_hover_async(lsp.HoverParams(text, position(PROGRAM, "HOME M1 speed", "speed")))
    assert hover is not None
    assert isinstance(hover.contents, lsp.MarkupContent)
    assert "#speed -40" in hover.contents.value
    items = await client.text_document_completion_async(lsp.CompletionParams(text, position(PROGRAM, "MOVEPTP @above", "above")))
    assert isinstance(items, lsp.CompletionList)
    assert [item.label for item in items.items] == ["above", "unused"]
    signature = await client.text_document_signature_help_async(
        lsp.SignatureHelpParams(text, position(PROGRAM, "PREL M1 12", "12"))
    )
    assert signature is not None
    assert (signature.signatures[0].label, signature.active_parameter) == ("PREL Mx distance", 1)
    found = await client.text_document_definition_async(lsp.DefinitionParams(text, position(PROGRAM, "MOVEPTP @above", "above")))
    assert isinstance(found, list)
    assert [location.uri for location in found if isinstance(location, lsp.Location)] == [controller.replace(".prg", ".csv")]
    place = position(PROGRAM, "count = count", "count")
    references = await client.text_document_references_async(lsp.ReferenceParams(lsp.ReferenceContext(True), text, place))
    assert references is not None
    assert len(references) == 4
    highlights = await client.text_document_document_highlight_async(lsp.DocumentHighlightParams(text, place))
    assert highlights is not None
    assert [h.kind for h in highlights] == [lsp.DocumentHighlightKind.Write, *[lsp.DocumentHighlightKind.Read] * 3]
    prepared = await client.text_document_prepare_rename_async(lsp.PrepareRenameParams(text, place))
    assert isinstance(prepared, lsp.PrepareRenamePlaceholder)
    assert prepared.placeholder == "count"
    renamed = await client.text_document_rename_async(lsp.RenameParams(text, place, "parts"))
    assert renamed is not None
    assert renamed.changes is not None
    assert len(renamed.changes[controller]) == 4
    with pytest.raises(JsonRpcInvalidParams, match="PosM1 is a register already"):
        await client.text_document_rename_async(lsp.RenameParams(text, place, "PosM1"))


@pytest.mark.asyncio
async def test_questions_about_texts(client: LanguageClient, controller: str) -> None:
    open_text(client, controller, PROGRAM.replace("x = sin", "x  =  sin"))
    text = lsp.TextDocumentIdentifier(controller)
    outline = await client.text_document_document_symbol_async(lsp.DocumentSymbolParams(text))
    assert outline is not None
    assert [section.name for section in outline][:4] == ["speed", "gripper", "ready", "MAIN"]
    folds = await client.text_document_folding_range_async(lsp.FoldingRangeParams(text))
    assert folds is not None
    assert (1, 3) in {(fold.start_line, fold.end_line) for fold in folds}
    edits = await client.text_document_formatting_async(lsp.DocumentFormattingParams(text, lsp.FormattingOptions(4, True)))
    assert edits is not None
    assert [edit.new_text for edit in edits] == ["SET x = sin(count)"]
    tokens = await client.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(text))
    assert tokens is not None
    # The comment with its emoji, which is two units of UTF-16.
    assert list(tokens.data[:5]) == [0, 0, 10, 1, 0]
    part = lsp.Range(lsp.Position(0, 0), lsp.Position(0, 5))
    tokens = await client.text_document_semantic_tokens_range_async(lsp.SemanticTokensRangeParams(text, part))
    assert tokens is not None
    assert len(tokens.data) == 5
    whole = lsp.Range(lsp.Position(0, 0), lsp.Position(99, 0))
    hints = await client.text_document_inlay_hint_async(lsp.InlayHintParams(text, whole))
    assert hints is not None
    assert "0.35 s" in [hint.label for hint in hints]  # gear, ramps and velocity come from the file in UTF-16
    links = await client.text_document_document_link_async(lsp.DocumentLinkParams(text))
    assert not links
    symbols = await client.workspace_symbol_async(lsp.WorkspaceSymbolParams("pick"))
    assert symbols is not None
    assert [symbol.name for symbol in symbols] == ["PICK"]


@pytest.mark.asyncio
async def test_call_hierarchy(client: LanguageClient, controller: str) -> None:
    open_text(client, controller, PROGRAM)
    params = lsp.CallHierarchyPrepareParams(lsp.TextDocumentIdentifier(controller), position(PROGRAM, "JUMP PICK", "PICK"))
    items = await client.text_document_prepare_call_hierarchy_async(params)
    assert items is not None
    (item,) = items
    assert item.name == "PICK"
    incoming = await client.call_hierarchy_incoming_calls_async(lsp.CallHierarchyIncomingCallsParams(item))
    assert incoming is not None
    assert [call.from_.name for call in incoming] == ["MAIN"]
    assert incoming[0].from_ranges[0].start == position(PROGRAM, "JUMP PICK", "PICK")
    outgoing = await client.call_hierarchy_outgoing_calls_async(lsp.CallHierarchyOutgoingCallsParams(incoming[0].from_))
    assert outgoing is not None
    assert [call.to.name for call in outgoing] == ["PICK", "MAIN"]


TEXTS = {
    "good program": (".prg", PROGRAM),
    "broken program": (".prg", BROKEN),
    "good M1486": (".m1486", CHIP),
    "broken M1486": (".m1486", BROKEN_CHIP),
    "good table": (".csv", TABLE),
    "broken table": (".csv", "a;1;2\n;x;y;z;1e9\na;1;2;3;4;5;6\n\nä;1;1;1;1\n"),
    "good configuration": (".cfg", CONFIG),
    "broken configuration": (".cfg", "[Axis0]\nGear=0\nAcc\nVel=\n[Axis\nX=1\n[IN99]\n=3\n"),
    "good world": (".toml", WORLD),
    "half-typed world": (".toml", WORLD + "[[axis]]\nname = \n[[wire\nfrom = 'ta"),
    "broken world": (".toml", WORLD.replace("pitch", "pich").replace('line = "bus"', 'line = "buss"')),
}


@pytest.mark.asyncio
async def test_every_question_about_any_text_has_an_answer(client: LanguageClient, tmp_path: Path) -> None:
    for name, (suffix, plain) in TEXTS.items():
        folder = tmp_path / name
        folder.mkdir()
        uri, text = (folder / f"machine{suffix}").as_uri(), plain.replace("\n", "\r\n" if "broken" in name else "\n")
        open_text(client, uri, text)
        found = await diagnostics(client, uri)
        assert bool(found) == (not name.startswith("good") or suffix == ".prg"), name  # the program has no table here
        try:
            await ask_everything(client, uri, text)
        except Exception as error:
            error.add_note(f"asked about: {name}")
            raise
        client.text_document_did_close(lsp.DidCloseTextDocumentParams(lsp.TextDocumentIdentifier(uri)))


async def ask_everything(client: LanguageClient, uri: str, broken: str) -> None:
    """Every request at the end of every line; an error of the server raises."""
    text = lsp.TextDocumentIdentifier(uri)
    for number, line in enumerate(broken.splitlines()):
        place = lsp.Position(number, len(line))
        part = lsp.Range(lsp.Position(number, 0), place)
        await client.text_document_hover_async(lsp.HoverParams(text, place))
        await client.text_document_completion_async(lsp.CompletionParams(text, place))
        await client.text_document_signature_help_async(lsp.SignatureHelpParams(text, place))
        await client.text_document_definition_async(lsp.DefinitionParams(text, place))
        await client.text_document_references_async(lsp.ReferenceParams(lsp.ReferenceContext(False), text, place))
        await client.text_document_document_highlight_async(lsp.DocumentHighlightParams(text, place))
        await client.text_document_code_action_async(lsp.CodeActionParams(text, part, lsp.CodeActionContext([])))
        await client.text_document_inlay_hint_async(lsp.InlayHintParams(text, part))
        for item in await client.text_document_prepare_call_hierarchy_async(lsp.CallHierarchyPrepareParams(text, place)) or ():
            await client.call_hierarchy_incoming_calls_async(lsp.CallHierarchyIncomingCallsParams(item))
            await client.call_hierarchy_outgoing_calls_async(lsp.CallHierarchyOutgoingCallsParams(item))
        # There need be no name that can be changed; then the client is told so.
        for asked in (
            client.text_document_prepare_rename_async(lsp.PrepareRenameParams(text, place)),
            client.text_document_rename_async(lsp.RenameParams(text, place, "new")),
        ):
            with contextlib.suppress(JsonRpcInvalidParams):
                await asked
    await client.text_document_document_symbol_async(lsp.DocumentSymbolParams(text))
    await client.text_document_folding_range_async(lsp.FoldingRangeParams(text))
    await client.text_document_formatting_async(lsp.DocumentFormattingParams(text, lsp.FormattingOptions(4, True)))
    await client.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(text))
    await client.text_document_document_link_async(lsp.DocumentLinkParams(text))
    await client.workspace_symbol_async(lsp.WorkspaceSymbolParams(""))


def test_what_is_refused_leaves_nothing_on_standard_error(tmp_path: Path) -> None:
    uri = (tmp_path / "x.prg").as_uri()
    place = {"textDocument": {"uri": uri}, "position": {"line": 0, "character": 0}}
    document = {"uri": uri, "languageId": "wbc", "version": 1, "text": "// x"}
    asked = [
        {"id": 1, "method": "initialize", "params": {"processId": None, "rootUri": None, "capabilities": {}}},
        {"method": "textDocument/didOpen", "params": {"textDocument": document}},
        {"id": 2, "method": "textDocument/prepareRename", "params": place},
        {"id": 3, "method": "shutdown"},
        {"method": "exit"},
    ]
    bodies = [json.dumps({"jsonrpc": "2.0", **one}) for one in asked]
    given = "".join(f"Content-Length: {len(body)}\r\n\r\n{body}" for body in bodies)
    done = subprocess.run(COMMAND, input=given.encode(), capture_output=True, timeout=60, check=False)
    assert b"there is no name here" in done.stdout
    assert done.stderr == b""


@pytest.mark.asyncio
async def test_a_change_of_a_file_outside_is_seen(client: LanguageClient, controller: str, tmp_path: Path) -> None:
    open_text(client, controller, PROGRAM)
    assert await diagnostics(client, controller) == []
    (tmp_path / "machine.csv").write_text("other;1;2;x;x\n")
    event = lsp.FileEvent(controller.replace(".prg", ".csv"), lsp.FileChangeType.Changed)
    client.workspace_did_change_watched_files(lsp.DidChangeWatchedFilesParams([event]))
    assert await diagnostics(client, controller) == ["W126"]


@pytest.mark.asyncio
async def test_a_change_of_a_text_that_is_not_open_is_no_end(client: LanguageClient, controller: str) -> None:
    change = lsp.TextDocumentContentChangePartial(lsp.Range(lsp.Position(0, 0), lsp.Position(0, 0)), "x")
    identifier = lsp.VersionedTextDocumentIdentifier(2, "file:///nowhere.prg")
    client.text_document_did_change(lsp.DidChangeTextDocumentParams(identifier, [change]))
    open_text(client, controller, PROGRAM)
    assert await diagnostics(client, controller) == []


class Wire:
    """What the server writes, without a process."""

    def __init__(self) -> None:
        self.sent: list[dict[str, Any]] = []
        self._protocol = server(NoFiles()).protocol
        self._protocol.set_writer(self, include_headers=False)

    def write(self, data: bytes) -> None:
        self.sent.append(json.loads(data))

    def close(self) -> None:
        pass

    def ask(self, method: str, params: object) -> dict[str, Any]:
        """The only answer."""
        self.sent.clear()
        message = {"jsonrpc": "2.0", "id": 7, "method": method, "params": params}
        self._protocol.handle_message(json.loads(json.dumps(message), object_hook=self._protocol.structure_message))
        (answer,) = self.sent
        assert answer["id"] == 7
        return answer


def hover_at(line: int) -> dict[str, Any]:
    return {"textDocument": {"uri": "file:///m/m.prg"}, "position": {"line": line, "character": 0}}


def test_every_request_has_an_answer(caplog: pytest.LogCaptureFixture) -> None:
    """Before initialize, after shutdown, and one with parameters that are none."""
    wire = Wire()
    assert wire.ask("textDocument/hover", hover_at(0))["error"]["code"] == -32002
    assert "capabilities" in wire.ask("initialize", {"processId": None, "rootUri": None, "capabilities": {}})["result"]
    assert wire.ask("textDocument/hover", hover_at(0))["result"] is None
    for params in (hover_at(-1), {}, None, [], {"textDocument": 5, "position": "x"}):
        refused = wire.ask("textDocument/hover", params)["error"]
        assert (refused["code"], refused["message"]) == (
            -32602,
            "textDocument/hover: its parameters are not those of the protocol",
        )
    assert caplog.records == []
    assert wire.ask("nothing/known", {})["error"]["code"] == -32601
    assert wire.ask("shutdown", None)["result"] is None
    assert wire.ask("textDocument/hover", hover_at(0))["error"]["code"] == -32600
