// The kinds of tests that a person fills in: their keys as the service reads them, in the units of the form.

const rate = { key: "sample_rate", label: "Sample rate", unit: "Hz", value: 1000 };
const motion = [
  { key: "amplitude", label: "Amplitude", unit: "mm", factor: 1e-3, value: 10 },
  { key: "frequency", label: "Frequency", unit: "Hz", value: 2 },
  { key: "cycles", label: "Cycles", value: 5 },
  { key: "settling_cycles", label: "Settling cycles", value: 1 },
];
const current = { key: "current", label: "Current", unit: "A", optional: true };
const seed = { key: "seed", label: "Seed", value: 1 };
const tones = [
  rate,
  { key: "period_samples", label: "Samples in a period", value: 4096 },
  { key: "periods", label: "Periods", value: 3 },
  seed,
  { key: "displacement/f_min", label: "Lowest frequency", unit: "Hz", value: 0.25 },
  { key: "displacement/f_max", label: "Highest frequency", unit: "Hz", value: 15 },
  { key: "displacement/max_displacement", label: "Largest displacement", unit: "mm", factor: 1e-3, value: 20 },
  { key: "displacement/max_velocity", label: "Largest velocity", unit: "m/s", value: 0.4 },
  { key: "displacement/spectrum", label: "Spectrum", options: ["flat", "quarter-car"], value: "quarter-car" },
];
const currents = (value) => [
  { key: "current/f_min", label: "Current from", unit: "Hz", optional: true, value: value && 0.25 },
  { key: "current/f_max", label: "Current to", unit: "Hz", optional: true, value: value && 50 },
  { key: "current/min", label: "Lowest current", unit: "A", optional: true, value: value && 0.3 },
  { key: "current/max", label: "Highest current", unit: "A", optional: true, value: value && 1.6 },
];

export const KINDS = {
  sine: { title: "Sine", fields: [...motion, current, rate] },
  triangle: { title: "Triangle (constant velocity)", fields: [...motion,
    { key: "corner_time", label: "Rounding of a corner", unit: "s", value: 0.02 }, current, rate] },
  steps: { title: "Current steps over a sine", fields: [...motion.slice(0, 3),
    { key: "levels", label: "Levels, with commas", unit: "A", list: true, value: "0, 0.5, 1" },
    { key: "step_time", label: "Time of a step", unit: "s", value: 1 }, seed, rate] },
  multisine: { title: "Random-phase multisine", fields: [...tones, ...currents()] },
  homogenised: { title: "Homogenised multisine", fields: [...tones, ...currents(true)],
    fixed: { homogenise: { method: "direct", variables: ["velocity", "current"], grid: [10, 10] } } },
};

// The number in a field; text that is none goes to the service as it is, which says what would be right.
function read(field, text) {
  if (field.options) return text;
  if (field.list) return text.split(",").map((one) => read({ ...field, list: false }, one.trim()));
  const value = Number(text.replace(",", "."));
  if (text.trim() === "" || !Number.isFinite(value)) return text;
  return field.factor ? Number((value * field.factor).toPrecision(12)) : value;
}

export function configOf(kind, name, heldOut, texts) {
  const config = { name, kind };
  for (const field of KINDS[kind].fields) {
    const text = texts[field.key] ?? "";
    if (field.optional && text.trim() === "") continue;
    const [outer, inner] = field.key.split("/");
    if (inner) (config[outer] ??= {})[inner] = read(field, text);
    else config[outer] = read(field, text);
  }
  if (heldOut) config.held_out = true;
  return { ...config, ...KINDS[kind].fixed };
}
