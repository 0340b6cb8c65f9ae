// Browsers start no worker for a page that is opened from a folder. There a hidden frame runs the script of the search,
// with the calls that the theme makes of a worker: a message each way.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      frame.srcdoc = "<!doctype html><title>search</title>";
      this.inside = new Promise((ready) => {
        frame.addEventListener("load", () => this.start(frame.contentWindow, new URL(url, location), ready), { once: true });
      });
      document.body.append(frame);
    }

    start(inside, url, ready) {
      inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
      const script = inside.document.createElement("script");
      script.addEventListener("load", () => ready(inside));
      script.src = url;
      inside.document.body.append(script);
    }

    async postMessage(data) {
      const inside = await this.inside;
      inside.dispatchEvent(new inside.MessageEvent("message", { data }));
    }
  };
}
