// The editor of the playground: CodeMirror, and a reader of SPICE's lines for the colours.

import { basicSetup, EditorView } from "codemirror";
import { keymap } from "@codemirror/view";
import { Prec } from "@codemirror/state";
import { StreamLanguage } from "@codemirror/language";

const spice = StreamLanguage.define({
  name: "spice",
  startState: () => ({ title: true }),
  token(stream, state) {
    if (state.title) {
      state.title = false;
      stream.skipToEnd();
      return "heading";
    }
    if (stream.sol() && stream.eatSpace() && stream.eol()) return null;
    if (stream.sol() && stream.match(/^\*.*/)) return "comment";
    if (stream.match(/^(;|\$ ).*/)) return "comment";
    if (stream.sol() && stream.match(/^[.+]\w*/)) return "keyword";
    if (stream.match(/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?[a-zµ]*/i)) return "number";
    if (stream.match(/^\w+(?==)/)) return "propertyName";
    if (!stream.match(/^[A-Za-z_][\w.]*/)) stream.next();
    return null;
  },
});

/** Put an editor into a node; `run` is called by Ctrl+Enter. */
export function editorIn(parent, run) {
  const keys = Prec.highest(keymap.of([{ key: "Mod-Enter", run: () => (run(), true) }]));
  const label = EditorView.contentAttributes.of({ "aria-label": "deck" });
  const view = new EditorView({ parent, extensions: [keys, basicSetup, spice, label] });
  return {
    get text() {
      return view.state.doc.toString();
    },
    set text(insert) {
      view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert } });
    },
  };
}
