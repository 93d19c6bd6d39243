// One test of the form: its kind, its fields, and what the check says of each.

import { make, set, show } from "./dom.js";
import { KINDS, configOf } from "./kinds.js";

let made = 0;

// options: { kind, name } for the form, or { config, from } for a test of a file, which is shown and not edited.
export function testCard(options, { changed, removed, repeated, chosen }) {
  const id = `test-${++made}`;
  const legend = make("legend");
  const line = make("p", { class: "wrong", hidden: true, id: id + "-wrong" });
  const facts = make("p", { class: "hint" });
  const node = make("fieldset", { class: "test" }, legend);
  const body = options.config && !options.texts ? fixed(options) : form(id, options, changed);
  const buttons = make("div", { class: "buttons" });
  if (!options.config || options.texts) buttons.append(make("button", { type: "button", onclick: repeated }, "Copy"));
  const name = () => body.config().name;
  buttons.append(make("button", { type: "button", onclick: removed }, "Remove"));
  node.append(body.node, line, facts, buttons);
  node.addEventListener("focusin", chosen);
  return {
    node, config: body.config, texts: body.texts, get kind() { return body.kind(); },
    place: (place) => set(legend, `Test ${place + 1}`),
    say: (text) => set(facts, text),
    clear() {
      show(line, false);
      set(facts, "");
      body.clear();
    },
    wrong(key, text) {
      if (body.wrong(key, text)) return;
      set(line, (line.hidden ? "" : line.textContent + " ") + text);
      show(line, true);
      node.setAttribute("aria-label", `${name()}: ${text}`);
    },
  };
}

function fixed({ config, from }) {
  const given = Object.entries(config).filter(([key]) => !["name", "kind"].includes(key))
    .map(([key, value]) => `${key} ${typeof value === "object" ? JSON.stringify(value) : value}`).join(", ");
  return {
    node: make("div", { tabindex: 0 }, make("strong", {}, config.name), ` ${config.kind} `, make("p", { class: "hint" }, `${given} (from ${from})`)),
    config: () => config, texts: () => undefined, kind: () => config.kind, clear() {}, wrong: () => false,
  };
}

function form(id, options, changed) {
  const name = make("input", { id: id + "-name", type: "text", maxlength: 200, required: true,
    value: options.config ? options.config.name : options.name ?? "test 1" });
  const kind = make("select", { id: id + "-kind" },
    ...Object.entries(KINDS).map(([value, { title }]) => make("option", { value, selected: value === options.kind }, title)));
  const heldOut = make("input", { id: id + "-held", type: "checkbox", checked: Boolean(options.config && options.config.held_out) });
  const fields = make("div", { class: "fields" });
  const inputs = new Map(); // key -> its input and its line for an error
  const nameWrong = make("p", { class: "wrong", hidden: true, id: id + "-name-wrong" });
  name.setAttribute("aria-describedby", nameWrong.id);
  const build = (texts) => {
    inputs.clear();
    inputs.set("name", { input: name, line: nameWrong });
    fields.replaceChildren(...KINDS[kind.value].fields.map((field) => fieldOf(id, field, texts, inputs)));
  };
  build(options.texts ?? {});
  kind.addEventListener("change", () => { build({}); changed(); });
  const node = make("div", {}, make("div", { class: "fields" },
    labelled("Name", name, nameWrong), labelled("Kind", kind), make("label", { class: "check" }, heldOut, "Held out for validation")), fields);
  node.addEventListener("input", changed);
  const texts = () => Object.fromEntries([...inputs].filter(([key]) => key !== "name").map(([key, { input }]) => [key, input.value]));
  const mark = ({ input, line }, text) => {
    set(line, text);
    show(line, text);
    if (text) input.setAttribute("aria-invalid", "true");
    else input.removeAttribute("aria-invalid");
  };
  return {
    node, texts, kind: () => kind.value,
    config: () => configOf(kind.value, name.value, heldOut.checked, texts()),
    clear: () => inputs.forEach((one) => mark(one, "")),
    wrong(key, text) {
      const found = inputs.get(key) ?? inputs.get(key.split("/").slice(0, 2).join("/")) ?? inputs.get(key.split("/")[0]);
      if (found) mark(found, text);
      return Boolean(found);
    },
  };
}

function labelled(text, input, line) {
  return make("div", { class: "field" }, make("label", { for: input.id }, text), input, ...(line ? [line] : []));
}

function fieldOf(id, field, texts, inputs) {
  const of = `${id}-${field.key.replace("/", "-")}`;
  const value = texts[field.key] ?? field.value ?? "";
  const input = field.options
    ? make("select", { id: of }, ...field.options.map((one) => make("option", { value: one, selected: one === value }, one)))
    : make("input", { id: of, type: "text", inputmode: field.list ? "text" : "decimal", value, autocomplete: "off" });
  const line = make("p", { class: "wrong", hidden: true, id: of + "-wrong" });
  input.setAttribute("aria-describedby", line.id);
  inputs.set(field.key, { input, line });
  return labelled(field.label + (field.unit ? ` (${field.unit})` : "") + (field.optional ? ", optional" : ""), input, line);
}
