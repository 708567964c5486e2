// Keeps a version of the page for use without a network: all its files, or none. The build writes VERSION and FILES above this:
// the digest of each file by its address below the scope. A version begins with a page of its own, never under one that is open.
/* global VERSION, FILES */

const SCOPE = self.registration.scope;
const OURS = `steptwin ${SCOPE} `;
const NAME = OURS + VERSION;

self.addEventListener("install", (event) => event.waitUntil(store()));
self.addEventListener("activate", (event) => event.waitUntil(removeOthers()));
self.addEventListener("message", (event) => event.waitUntil(begin(event.source)));
self.addEventListener("fetch", (event) => {
  const { method, url } = event.request;
  if (method === "GET" && url.startsWith(SCOPE)) event.respondWith(answer(event.request));
});

async function store() {
  try {
    const cache = await caches.open(NAME);
    await Promise.all(Object.entries(FILES).map(([file, integrity]) => add(cache, new URL(file, SCOPE), integrity)));
  } catch (error) {
    await caches.delete(NAME);
    // Where another version is stored, that one stays.
    if (self.registration.active === null)
      for (const page of await pages()) page.postMessage({ failed: error.message });
    throw error;
  }
}

async function add(cache, address, integrity) {
  // A server that is being updated has files of both versions: the digest refuses one of the other.
  const response = await fetch(address, { integrity, cache: "no-cache" }).catch(async (error) => {
    throw new Error(`${address}: ${await whyNot(address).catch(() => error.message)}`);
  });
  await cache.put(address, response);
}

/** Why a file was refused: browsers do not say it. */
async function whyNot(address) {
  const { ok, status, statusText } = await fetch(address, { method: "HEAD", cache: "no-store" });
  return ok ? "it did not come as it was built" : `${status} ${statusText}`;
}

async function removeOthers() {
  const names = await caches.keys();
  await Promise.all(names.filter((name) => name.startsWith(OURS) && name !== NAME).map((name) => caches.delete(name)));
}

async function begin(page) {
  const others = (await pages()).length - 1;
  if (others) page.postMessage({ others });
  else await self.skipWaiting();
}

async function pages() {
  const all = await self.clients.matchAll({ type: "window", includeUncontrolled: true });
  return all.filter((page) => page.url.startsWith(SCOPE));
}

async function answer(request) {
  const address = request.url === `${SCOPE}index.html` ? SCOPE : request;
  const cache = await caches.open(NAME);
  // All requests of the page get the same answers.
  return (await cache.match(address, { ignoreSearch: true, ignoreVary: true })) ?? fetch(request);
}
