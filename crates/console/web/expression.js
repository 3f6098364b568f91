// Expressions of properties, such as `hypot({r2/odometry/twist/linear}, 2)`: names are in braces.

const FUNCTIONS = { abs: Math.abs, atan2: Math.atan2, cos: Math.cos, degrees: (angle) => (angle * 180) / Math.PI, exp: Math.exp, hypot: Math.hypot, log: Math.log, max: Math.max, min: Math.min, sin: Math.sin, sqrt: Math.sqrt, tan: Math.tan };
const CONSTANTS = { pi: Math.PI };
const PARTS = /\s*(?:(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+)|\{([^{}]+)\}|([a-z]\w*)|([-+*/^(),]))/iy;

// The unit of a sum is that of all its operands if they have one in common; constants have no unit.
const same = (units) => (units.every((unit) => unit === units[0]) ? units[0] : "");
const factor = (left, right) => (left === null ? right : right === null ? left : "");
const UNITS = { abs: same, hypot: same, max: same, min: same, atan2: (units) => (same(units) ? "rad" : ""), degrees: ([unit]) => (unit === "rad" ? "deg" : "") };

/** The names of the functions. */
export const functions = Object.keys(FUNCTIONS).join(", ");

function parts(text) {
  const found = [];
  PARTS.lastIndex = 0;
  while (PARTS.lastIndex < text.trimEnd().length) {
    const at = PARTS.lastIndex;
    const part = PARTS.exec(text);
    if (!part) throw new Error(`“${text.slice(at).trim()}” is not part of an expression`);
    found.push(part[1] !== undefined ? { number: Number(part[1]) } : part[2] !== undefined ? { input: part[2].trim() } : part[3] !== undefined ? { word: part[3] } : { sign: part[4] });
  }
  return found;
}

/** Parses an expression: the names of its `inputs`, and functions for its value and its unit. Throws a syntax error. */
export function parse(text) {
  const [all, inputs] = [parts(text), []];
  let place = 0;
  const sign = () => all[place]?.sign;
  const take = (wanted) => sign() === wanted && (place += 1, true);
  const demand = (wanted) => {
    if (!take(wanted)) throw new Error(`“${wanted}” is missing${all[place] ? ` before “${Object.values(all[place])[0]}”` : " at the end"}`);
  };
  const sum = () => {
    let left = product();
    for (;;) {
      const before = left;
      const minus = sign() === "-";
      if (!take("+") && !take("-")) return left;
      const right = product();
      left = { of: (values) => (minus ? before.of(values) - right.of(values) : before.of(values) + right.of(values)), unit: (units) => same([before.unit(units), right.unit(units)]) };
    }
  };
  const product = () => {
    let left = negative();
    for (;;) {
      const before = left;
      const isRatio = sign() === "/";
      if (!take("*") && !take("/")) return left;
      const right = negative();
      left = isRatio
        ? { of: (values) => before.of(values) / right.of(values), unit: (units) => (right.unit(units) === null ? before.unit(units) : "") }
        : { of: (values) => before.of(values) * right.of(values), unit: (units) => factor(before.unit(units), right.unit(units)) };
    }
  };
  const negative = () => {
    if (take("-")) { const { of, unit } = negative(); return { of: (values) => -of(values), unit }; }
    return power();
  };
  const power = () => {
    const base = single();
    if (!take("^")) return base;
    const exponent = negative();
    return { of: (values) => base.of(values) ** exponent.of(values), unit: (units) => (base.unit(units) === null && exponent.unit(units) === null ? null : "") };
  };
  const single = () => {
    const part = all[place];
    place += 1;
    if (part?.number !== undefined) return { of: () => part.number, unit: () => null };
    if (part?.input !== undefined) {
      if (!inputs.includes(part.input)) inputs.push(part.input);
      const own = inputs.indexOf(part.input);
      return { of: (values) => values[own], unit: (units) => units[own] };
    }
    if (part?.sign === "(") {
      const inner = sum();
      demand(")");
      return inner;
    }
    if (part?.word && Object.hasOwn(CONSTANTS, part.word)) return { of: () => CONSTANTS[part.word], unit: () => null };
    if (!part?.word || !Object.hasOwn(FUNCTIONS, part.word)) throw new Error(part ? `“${part.word ?? part.sign}” is not a number; functions: ${functions}; write names in braces` : "a number is missing at the end");
    demand("(");
    const given = [sum()];
    while (take(",")) given.push(sum());
    demand(")");
    return {
      of: (values) => FUNCTIONS[part.word](...given.map((one) => one.of(values))),
      unit: (units) => (UNITS[part.word] ?? (() => ""))(given.map((one) => one.unit(units))),
    };
  };
  const whole = sum();
  if (place < all.length) throw new Error(`“${Object.values(all[place])[0]}” is unexpected`);
  return { inputs, compute: whole.of, unit: (units) => whole.unit(units) ?? "" };
}
