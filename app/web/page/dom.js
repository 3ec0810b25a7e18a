// Elements, grey images and files, for the other modules.

export const $ = (id) => document.getElementById(id);

/** Opened as a file, from a disk or a share, without a server. */
export const inFolder = location.protocol === 'file:';

export function loadScript(path) {
    return new Promise((resolve, refuse) => {
        const script = el('script', {src: path, load: () => resolve(script.remove()), error: () => {
            script.remove();
            refuse(new Error(`${path}: expected the file beside this page, found none that can be read`));
        }});
        document.head.append(script);
    });
}

/** el('p', {class: 'faint', text: 'words', click: f, 'aria-label': '…'}, child, …) */
export function el(tag, properties = {}, ...children) {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(properties)) {
        if (value === undefined || value === false) continue;
        if (name === 'text') element.textContent = value;
        else if (typeof value === 'function') element.addEventListener(name, value);
        else element.setAttribute(name, value === true ? '' : value);
    }
    element.append(...children);
    return element;
}

/** Only what differs is written: the room does this at every image. */
export function say(element, words) {
    if (element.textContent !== words) element.textContent = words;
}

export function show(element, is = true) {
    if (element.hidden === is) element.hidden = !is;
}

const greys = Uint32Array.from({length: 256}, (_, grey) => (0xff000000 | grey * 0x010101) >>> 0);

/** Draws grey values as they are; the style of the canvas scales them. */
export function drawGrey(canvas, {width, height, pixels}) {
    if (canvas.width !== width || canvas.height !== height) {
        canvas.width = width;
        canvas.height = height;
    }
    const context = canvas.getContext('2d', {alpha: false});
    const data = context.createImageData(width, height);
    const words = new Uint32Array(data.data.buffer);
    for (let k = 0; k < words.length; ++k) words[k] = greys[pixels[k]];
    context.putImageData(data, 0, 0);
}

/** A canvas as sharp as the screen; its context is in CSS pixels. */
export function sharp(canvas) {
    const scale = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    const pixels = [Math.round(width * scale), Math.round(height * scale)];
    if (canvas.width !== pixels[0] || canvas.height !== pixels[1]) [canvas.width, canvas.height] = pixels;
    const context = canvas.getContext('2d');
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, width, height);
    return {context, width, height};
}

export function download(name, content, type = 'application/octet-stream') {
    const address = URL.createObjectURL(new Blob([content], {type}));
    el('a', {href: address, download: name}).click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
}

const paperPolicy = "sandbox allow-scripts; default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/**
 * A page made elsewhere, in a frame that has neither this page's origin nor the network. The service worker hands it
 * out with its policy; without one, paper.html takes it by message, which needs a connection.
 */
export async function paper(html, title) {
    try {
        if (!navigator.serviceWorker.controller) throw new Error('no service worker');
        const src = `paper/${Date.now()}.html`, headers = {'content-type': 'text/html; charset=utf-8', 'content-security-policy': paperPolicy};
        await caches.delete('seldinger-paper');
        await (await caches.open('seldinger-paper')).put(src, new Response(html, {headers}));
        return el('iframe', {src, title});
    } catch {
        const frame = el('iframe', {sandbox: 'allow-scripts', src: 'paper.html', title});
        addEventListener('message', function hear({source, data}) {
            if (source !== frame.contentWindow || data !== 'paper') return;
            removeEventListener('message', hear);
            frame.contentWindow.postMessage(html, '*');
        });
        return frame;
    }
}

export const counted = (count, noun) => `${count} ${noun}${count === 1 ? '' : 's'}`;

export function openDialog(dialog) {
    if (!dialog.open) dialog.showModal();
}
