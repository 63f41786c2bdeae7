// The page: an editor, the run in a worker, and its report in a frame.

import { addressOf, deckOf } from "./address.js";

const here = new URL(".", import.meta.url);
const place = document.getElementById("simulator");
const json = async name => {
  const answer = await fetch(new URL(name, here));
  return answer.ok ? answer.json() : null;
};
const add = (parent, tag, properties = {}, text = "") => {
  const node = Object.assign(document.createElement(tag), properties);
  node.textContent = text;
  parent.append(node);
  return node;
};

const status = add(place, "p", { className: "status", role: "status" });
const decks = await json("decks.json");
const runtime = await json("runtime.json");
if (runtime) await start();
else status.textContent = "This copy of the site was built without the compiled core: make playground, then make docs.";

async function start() {
  const { editorIn } = await import("./editor.min.js");
  const bar = add(place, "div", { className: "bar" });
  const choice = add(bar, "select", { ariaLabel: "deck of the gallery" });
  for (const deck of decks) add(choice, "option", { value: deck.name }, deck.name);
  const button = add(bar, "button", { type: "button", className: "md-button md-button--primary" }, "Run");
  const editor = editorIn(add(place, "div", { className: "editor" }), () => button.click());
  const messages = add(place, "pre", { className: "messages", hidden: true });
  const frame = add(place, "iframe", { title: "report", hidden: true });
  let worker = null;
  let name = "";

  const show = deck => { name = deck.name; choice.value = deck.name; editor.text = deck.text; };
  const idle = text => { status.textContent = text; button.textContent = "Run"; };
  const stop = text => { worker?.terminate(); worker = null; idle(text); };
  const found = await deckOf(location.hash, decks);
  show(found ?? decks.find(deck => deck.name === "converters/buck") ?? decks[0]);
  idle(location.hash && !found ? "The address holds no deck that can be read." : "Ctrl+Enter runs the deck.");

  choice.onchange = () => {
    show(decks.find(deck => deck.name === choice.value));
    history.replaceState(null, "", `#deck=${name}`);
  };
  addEventListener("hashchange", async () => {
    const deck = await deckOf(location.hash, decks);
    if (deck) show(deck);
  });

  button.onclick = async () => {
    if (button.textContent === "Stop") return stop("Stopped.");
    history.replaceState(null, "", await addressOf(editor.text, decks));
    messages.hidden = frame.hidden = true;
    button.textContent = "Stop";
    if (!worker) {
      worker = new Worker(new URL("worker.js", here), { type: "module" });
      worker.onmessage = ({ data }) => answered(data);
      worker.onerror = event => stop(`The worker failed: ${event.message}`);
      worker.postMessage({ runtime });
    }
    worker.postMessage({ text: editor.text, name });
  };

  function answered({ stage, failed, page, messages: text, seconds }) {
    if (stage) return void (status.textContent = stage);
    if (failed) return stop(failed);
    messages.textContent = text;
    messages.hidden = !text;
    if (page) {
      URL.revokeObjectURL(frame.src);
      frame.src = URL.createObjectURL(new Blob([page], { type: "text/html" }));
      frame.hidden = false;
    }
    idle(page ? `Done in ${seconds.toFixed(1)} s.` : "The deck was refused.");
  }
}
