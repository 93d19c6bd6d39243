// Nodes of the page. Text is only ever text; nodes stay where they are, so that focus, selection and scroll stay too.

export const at = (id) => document.getElementById(id);

// make("button", { class: "go", type: "button", onclick: f }, "text", node, …)
export function make(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === false || value === undefined || value === null) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children);
  return node;
}

export function set(node, text) {
  const words = String(text ?? "");
  if (node.textContent !== words) node.textContent = words;
}

export function show(node, visible) {
  if (node.hidden !== Boolean(visible)) return;
  if (!visible && node.contains(document.activeElement)) queueMicrotask(() => rest(node.parentElement));
  node.hidden = !visible;
}

// The focus of what has gone goes to what it was in, never to another button: the next Tab leads on from there, and a
// second Enter does nothing.
export function rest(node) {
  let near = node;
  while (!near.checkVisibility()) near = near.parentElement;
  near.tabIndex = -1;
  near.focus({ preventScroll: true });
}

export function attribute(node, name, value) {
  if (node.getAttribute(name) !== String(value)) node.setAttribute(name, value);
}

// A state: its word, and a class for its colour. The word alone says it.
export function state(node, word, kind = word) {
  set(node, word);
  attribute(node, "class", "state " + kind.replace(/[^a-z]+/g, "-"));
}

const rows = new WeakMap(); // container -> its rows by key

// One node for each item, in order; a node is made once for a key and afterwards only updated.
// create(item) returns { node, update(item) }.
export function keyed(container, items, keyOf, create) {
  const known = rows.get(container) ?? rows.set(container, new Map()).get(container);
  const wanted = new Map(items.map((item) => [String(keyOf(item)), item]));
  const focused = document.activeElement;
  let left = -1; // the place of the row that went with the focus
  for (const [key, row] of known) {
    if (!wanted.has(key)) {
      if (row.node.contains(focused)) left = [...container.children].indexOf(row.node);
      row.node.remove();
      known.delete(key);
    }
  }
  let place = container.firstChild;
  for (const [key, item] of wanted) {
    const row = known.get(key) ?? known.set(key, create(item)).get(key);
    row.update(item);
    if (row.node === place) place = place.nextSibling;
    else container.insertBefore(row.node, place);
  }
  if (left >= 0) rest(container.children[left] ?? container.lastElementChild ?? container);
  else if (focused !== document.activeElement && container.contains(focused)) focused.focus({ preventScroll: true });
}
