/**
 * Browsers refuse Web Workers on pages that are opened as files. The search of the site is one: there it runs in a hidden
 * frame, which has what its script asks of a worker (mkdocs.yml, `extra.polyfills`). From a server nothing changes.
 */
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(address) {
      super();
      this.frame = document.createElement("iframe");
      this.frame.hidden = true;
      this.ready = new Promise((done) => {
        this.frame.addEventListener("load", () => this.start(address, done), { once: true });
      });
      document.body.append(this.frame);
    }

    start(address, done) {
      const inner = this.frame.contentWindow;
      inner.postMessage = (data) => {
        const event = new MessageEvent("message", { data });
        this.dispatchEvent(event);
        this.onmessage?.(event);
      };
      inner.importScripts = async (...files) => {
        for (const file of files) await load(inner.document, file);
      };
      load(inner.document, address).then(done);
    }

    postMessage(data) {
      this.ready.then(() => {
        const { MessageEvent: Inner } = this.frame.contentWindow;
        this.frame.contentWindow.dispatchEvent(new Inner("message", { data: structuredClone(data) }));
      });
    }

    terminate() {
      this.frame.remove();
    }
  };

  const load = (page, address) =>
    new Promise((done, failed) => {
      const script = page.createElement("script");
      Object.assign(script, { src: address, onload: done, onerror: failed });
      page.body.append(script);
    });
}
