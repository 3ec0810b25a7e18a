// Becomes the page that it is sent, once. Its frame is sandboxed; nothing can be loaded from here.
addEventListener('message', ({data, source}) => {
    if (source !== parent || typeof data !== 'string') return;
    document.open();
    document.write(data);
    document.close();
}, {once: true});
parent.postMessage('paper', '*');
