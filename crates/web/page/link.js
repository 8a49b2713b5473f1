// Settings as the part of the page's address after the #: fields `dotted.path=value` joined by &, such as
// `surface.preset=cd&sun.elevation_deg=20`. Browsers never send this part to a server.

/** Fields that are text even if they look like numbers. */
const TEXTS = new Set(["surface.filename", "surface.channel"]);

/** Returns [dotted path, text] for every field of `value`; `path` is the dotted path of `value` itself. */
function flatten(value, path = "") {
  if (value !== null && typeof value === "object" && !Array.isArray(value)) {
    return Object.entries(value).flatMap(([key, inner]) => flatten(inner, path ? `${path}.${key}` : key));
  }
  return [[path, Array.isArray(value) ? value.join(",") : String(value)]];
}

/** Value of the field at `path` from its text: a boolean, a number, a name, or with commas a list of these. */
function parsed(path, text) {
  if (TEXTS.has(path)) return text;
  const scalar = (word) => {
    if (word === "true" || word === "false") return word === "true";
    return word.trim() !== "" && Number.isFinite(Number(word)) ? Number(word) : word;
  };
  return text.includes(",") ? text.split(",").map(scalar) : scalar(text);
}

/**
 * The part of an address after the #, for compact settings (`Engine.compact`), whose lists have two elements or more.
 * `sha256` is the checksum of the surface's file, or null without a file. Empty for default settings without a file.
 */
export function toHash(compact, sha256) {
  const fields = flatten(compact);
  if (sha256) fields.push(["sha256", sha256]);
  // Commas need no encoding, and without it lists stay readable.
  return fields.map(([path, text]) => `${path}=${encodeURIComponent(text).replaceAll("%2C", ",")}`).join("&");
}

/** Reads {settings, sha256} from an address's part after the #; sha256 may be null. Values are not validated. */
export function fromHash(hash) {
  const settings = {};
  let sha256 = null;
  // In addresses written by hand, URLSearchParams would read + as a space.
  for (const [path, text] of new URLSearchParams(hash.replace(/^#/, "").replaceAll("+", "%2B"))) {
    if (path === "sha256") {
      sha256 = text;
      continue;
    }
    const keys = path.split(".");
    // __proto__ leads to the prototype of every object of the page; the others are refused as a precaution.
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
