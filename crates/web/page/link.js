// Settings in the page's address, after the #, as `dotted.path=value` joined by &:
// `surface.preset=cd&sun.elevation_deg=20`. Browsers never send this part to a server.

/** Fields that are text even where they look like numbers. */
const TEXTS = new Set(["surface.filename", "surface.channel", "sha256"]);

/** Appends [dotted.path, text] of every field of a value. */
function flatten(value, path, into) {
  if (value !== null && typeof value === "object" && !Array.isArray(value)) {
    for (const [key, inner] of Object.entries(value)) flatten(inner, path ? `${path}.${key}` : key, into);
  } else {
    into.push([path, Array.isArray(value) ? value.join(",") : String(value)]);
  }
  return into;
}

/** The value of a field from its text: booleans, numbers, names, and lists of these with commas. */
function parsed(path, text) {
  if (TEXTS.has(path)) return text;
  const scalar = (word) => {
    if (word === "true" || word === "false") return word === "true";
    return word.trim() !== "" && Number.isFinite(Number(word)) ? Number(word) : word;
  };
  return text.includes(",") ? text.split(",").map(scalar) : scalar(text);
}

/** The part of an address after the #, for compact settings and the checksum of their file. */
export function toHash(compact, sha256) {
  const fields = flatten(compact, "", []);
  if (sha256) fields.push(["sha256", sha256]);
  // Lists stay readable.
  return fields.map(([path, text]) => `${path}=${encodeURIComponent(text).replaceAll("%2C", ",")}`).join("&");
}

/** The settings and the checksum in the part of an address after the #. */
export function fromHash(hash) {
  const settings = {};
  let sha256 = null;
  for (const [path, text] of new URLSearchParams(hash.replace(/^#/, "").replaceAll("+", "%2B"))) {
    if (path === "sha256") {
      sha256 = text;
      continue;
    }
    const keys = path.split(".");
    // These names would change every object of the page.
    if (keys.some((key) => key === "__proto__" || key === "constructor" || key === "prototype")) continue;
    let inner = settings;
    for (const key of keys.slice(0, -1)) {
      if (typeof inner[key] !== "object") inner[key] = {};
      inner = inner[key];
    }
    inner[keys.at(-1)] = parsed(path, text);
  }
  return { settings, sha256 };
}
