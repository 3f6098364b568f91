// The structure of values, from the JSON Schema of their interfaces.

const typeOf = (schema) => {
  const types = [schema.type ?? []].flat();
  if (schema.anyOf?.[0]?.enum) return "enumeration";
  if (schema.anyOf) return typeOf({ ...schema, ...schema.anyOf[0], anyOf: undefined });
  return types.find((type) => type !== "null") ?? "any";
};

/** The names of the fields, in the order of the interface. */
export const order = (schema) => schema["x-order"] ?? Object.keys(schema.properties);

/** The leaves of a value: `{pointer, name, type, unit, doc, schema}`; lists are one leaf. */
export function leaves(schema, pointer = "") {
  if (!schema) return [];
  const type = typeOf(schema);
  if (type !== "object" || !schema.properties) {
    const name = pointer.slice(1).replaceAll("/", ".");
    return [{ pointer, name, type, unit: schema["x-unit"] ?? "", doc: schema.description ?? "", schema }];
  }
  return order(schema)
    .filter((name) => name !== "reserved")
    .flatMap((name) => leaves(schema.properties[name], `${pointer}/${name}`));
}

/** The leaves that can be plotted. */
export const numbers = (schema) => leaves(schema).filter(({ type }) => ["number", "integer", "boolean"].includes(type));

/** The query parameters for a part of a value: none, a JSON Pointer, or a JSONPath, which begins with `$`. */
export const selection = (part) => (!part ? {} : part.startsWith("$") ? { select: part } : { pointer: part });

/** The unit at a JSON Pointer, which may lead into lists. */
export function unitAt(schema, pointer) {
  for (const name of pointer.split("/").slice(1)) schema = schema?.properties?.[name] ?? (/^\d+$/.test(name) ? schema?.items : undefined);
  return schema?.["x-unit"] ?? "";
}

/** The part of a value at a JSON Pointer. */
export function part(value, pointer) {
  for (const name of pointer.split("/").slice(1)) value = value?.[name];
  return value;
}
