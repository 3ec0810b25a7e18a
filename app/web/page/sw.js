// Keeps the page for use without a connection. files.json lists what it consists of: [{path, bytes, hash}, …]; entries
// with "later": true are kept when they were first used. A new files.json is a new cache, which takes from the old one
// what has the same hash, and is used once it is complete and the page is opened again.

const state = 'seldinger-state', root = new URL('.', self.location).href, lists = 'files.json';
const cacheName = async (text) => `seldinger-${await hashOf(new TextEncoder().encode(text))}`;

async function hashOf(bytes) {
    const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes));
    return [...digest].map((byte) => byte.toString(16).padStart(2, '0')).join('');
}

async function kept(which) {
    const found = await (await caches.open(state)).match(root + which);
    return found ? found.text() : null;
}

async function fetchWhole({path, hash}) {
    const response = await fetch(root + path, {cache: 'no-cache'});
    if (!response.ok) throw new Error(`${path}: the server answered ${response.status}`);
    if (/^[0-9a-f]{64}$/.test(hash) && await hashOf(await response.clone().arrayBuffer()) !== hash)
        throw new Error(`${path}: its hash is not that of ${lists}`);
    return response;
}

let running = null;
const update = () => running ??= load().finally(() => running = null);

async function load() {
    const response = await fetch(root + lists, {cache: 'no-store'});
    if (!response.ok) return;
    const text = await response.text(), current = await kept('current');
    if (text === current || text === await kept('next')) return;
    const files = JSON.parse(text), before = new Map(JSON.parse(current ?? '[]').map(({path, hash}) => [path, hash]));
    const cache = await caches.open(await cacheName(text)), old = current ? await caches.open(await cacheName(current)) : null;
    for (const file of files) {
        const same = old && before.get(file.path) === file.hash ? await old.match(root + file.path) : null;
        if (same) await cache.put(root + file.path, same);
        else if (!file.later) await cache.put(root + file.path, await fetchWhole(file));
    }
    await (await caches.open(state)).put(root + (current ? 'next' : 'current'), new Response(text));
    if (current) for (const client of await self.clients.matchAll()) client.postMessage({is: 'updated'});
}

async function adopt() {
    const next = await kept('next');
    if (!next) return;
    const states = await caches.open(state);
    await states.put(root + 'current', new Response(next));
    await states.delete(root + 'next');
    const name = await cacheName(next);
    for (const other of await caches.keys())
        if (other.startsWith('seldinger-') && other !== state && other !== name) await caches.delete(other);
}

async function answer(request) {
    if (request.mode === 'navigate' && request.destination === 'document') await adopt();
    const address = request.url.split(/[?#]/)[0];
    if (address.startsWith(root + 'paper/')) return await caches.match(address) ?? Response.error();
    const current = await kept('current');
    if (!current) return fetch(request);
    const cache = await caches.open(await cacheName(current));
    const found = await cache.match(address === root ? root + 'index.html' : address);
    if (found) return found;
    const response = await fetch(request);
    if (response.ok && response.status === 200 && address !== root + lists) await cache.put(address, response.clone()).catch(() => undefined);
    return response;
}

self.addEventListener('install', (event) => event.waitUntil(update().then(() => self.skipWaiting())));
self.addEventListener('activate', (event) => event.waitUntil(self.clients.claim()));
self.addEventListener('message', (event) => {
    if (event.data?.do === 'update') event.waitUntil(update().catch(() => undefined));
});
self.addEventListener('fetch', (event) => {
    const {request} = event;
    if (request.method !== 'GET' || !request.url.startsWith(root) || request.headers.has('range')) return;
    if (request.url === root + lists) return;
    event.respondWith(answer(request).catch(() => Response.error()));
});
