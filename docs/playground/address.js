// The deck in the address: `#deck=converters/buck` is one of the gallery, `#text=...` any other.

const through = async (bytes, stream) =>
  new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());

/** The part behind # for a deck: its name if it is one of the gallery, else its text, compressed. */
export async function addressOf(text, decks) {
  const known = decks.find(deck => deck.text === text);
  if (known) return `#deck=${known.name}`;
  const bytes = await through(new TextEncoder().encode(text), new CompressionStream("deflate-raw"));
  const letters = btoa(Array.from(bytes, b => String.fromCharCode(b)).join(""));
  return `#text=${letters.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "")}`;
}

/** The deck that an address holds: { name, text }, null if it holds none. */
export async function deckOf(hash, decks) {
  const [, kind, value] = hash.match(/^#(deck|text)=(.*)$/) ?? [];
  if (kind === "deck") return decks.find(deck => deck.name === value) ?? null;
  if (kind !== "text") return null;
  try {
    const letters = atob(value.replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(letters, c => c.charCodeAt(0));
    const text = await through(bytes, new DecompressionStream("deflate-raw"));
    return { name: "deck", text: new TextDecoder().decode(text) };
  } catch {
    return null; // cut off on its way
  }
}
