// Numbers that are computed of others, such as `hypot({r2/odometry/twist/linear}, 2)`: names of numbers stand in braces.

const FUNCTIONS = { abs: Math.abs, atan2: Math.atan2, cos: Math.cos, degrees: (angle) => (angle * 180) / Math.PI, exp: Math.exp, hypot: Math.hypot, log: Math.log, max: Math.max, min: Math.min, sin: Math.sin, sqrt: Math.sqrt, tan: Math.tan };
const CONSTANTS = { pi: Math.PI };
const PARTS = /\s*(?:(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+)|\{([^{}]+)\}|([a-z]\w*)|([-+*/^(),]))/iy;

/** What functions there are. */
export const functions = Object.keys(FUNCTIONS).join(", ");

function parts(text) {
  const found = [];
  PARTS.lastIndex = 0;
  while (PARTS.lastIndex < text.trimEnd().length) {
    const at = PARTS.lastIndex;
    const part = PARTS.exec(text);
    if (!part) throw new Error(`“${text.slice(at).trim()}” is nothing that can be computed`);
    found.push(part[1] !== undefined ? { number: Number(part[1]) } : part[2] !== undefined ? { input: part[2].trim() } : part[3] !== undefined ? { word: part[3] } : { sign: part[4] });
  }
  return found;
}

/** An expression: the names of its `inputs`, and what it is of their values, in their order. Throws what is wrong with it. */
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
      if (take("+")) { const right = product(); left = (values) => before(values) + right(values); }
      else if (take("-")) { const right = product(); left = (values) => before(values) - right(values); }
      else return left;
    }
  };
  const product = () => {
    let left = negative();
    for (;;) {
      const before = left;
      if (take("*")) { const right = negative(); left = (values) => before(values) * right(values); }
      else if (take("/")) { const right = negative(); left = (values) => before(values) / right(values); }
      else return left;
    }
  };
  const negative = () => {
    if (take("-")) { const of = negative(); return (values) => -of(values); }
    return power();
  };
  const power = () => {
    const base = single();
    if (!take("^")) return base;
    const exponent = negative();
    return (values) => base(values) ** exponent(values);
  };
  const single = () => {
    const part = all[place];
    place += 1;
    if (part?.number !== undefined) return () => part.number;
    if (part?.input !== undefined) {
      if (!inputs.includes(part.input)) inputs.push(part.input);
      const own = inputs.indexOf(part.input);
      return (values) => values[own];
    }
    if (part?.sign === "(") {
      const inner = sum();
      demand(")");
      return inner;
    }
    if (part?.word && Object.hasOwn(CONSTANTS, part.word)) return () => CONSTANTS[part.word];
    if (!part?.word || !Object.hasOwn(FUNCTIONS, part.word)) throw new Error(part ? `“${part.word ?? part.sign}” is no number; functions are ${functions}; names stand in braces` : "a number is missing at the end");
    demand("(");
    const given = [sum()];
    while (take(",")) given.push(sum());
    demand(")");
    return (values) => FUNCTIONS[part.word](...given.map((one) => one(values)));
  };
  const compute = sum();
  if (place < all.length) throw new Error(`“${Object.values(all[place])[0]}” is too much`);
  return { inputs, compute };
}
