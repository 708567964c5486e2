// TypeScript types from docs/studio.schema.json, written to src/lib/protocol/types.ts before each build, check and test of the page.
// A file that is as it should be is left, so that the built page does not become older than its sources.

import { existsSync, readFileSync, writeFileSync } from "node:fs";

const SCHEMA = new URL("../../docs/studio.schema.json", import.meta.url);
const TYPES = new URL("../src/lib/protocol/types.ts", import.meta.url);

const camel = (name) =>
  name
    .replace(/[^A-Za-z0-9]+/g, " ")
    .trim()
    .split(" ")
    .map((word) => word[0].toUpperCase() + word.slice(1))
    .join("");

/** The name of the type of a definition: `jog` is a request, `jog answer` what it is answered with. An `Event` is the browser's. */
const typeName = (name) =>
  name === "(event)"
    ? "SubjectEvent"
    : name.startsWith("(")
      ? camel(name)
      : / (answer|message)$/.test(name)
        ? camel(name)
        : `${camel(name)}Request`;

const literal = (value) => JSON.stringify(value);
const union = (types) => [...new Set(types)].join(" | ");
const inBrackets = (type) => (type.includes(" | ") ? `(${type})` : type);

/** The TypeScript type of a schema; `indent` is that of the line it stands in. */
function typeOf(schema, indent = "") {
  if (schema.$ref) return typeName(schema.$ref.replace("#/$defs/", ""));
  if ("const" in schema) return literal(schema.const);
  if (schema.enum) return union(schema.enum.map(literal));
  const either = schema.anyOf ?? (schema.properties ? undefined : schema.oneOf);
  if (either) return union(either.map((one) => typeOf(one, indent)));
  if (Array.isArray(schema.type)) return union(schema.type.map((type) => typeOf({ ...schema, type }, indent)));
  switch (schema.type) {
    case "integer":
    case "number":
      return "number";
    case "string":
    case "boolean":
    case "null":
      return schema.type;
    case "array":
      if (schema.prefixItems) return `[${schema.prefixItems.map((item) => typeOf(item, indent)).join(", ")}]`;
      return `${inBrackets(typeOf(schema.items ?? {}, indent))}[]`;
    case "object":
      return objectType(schema, indent);
    default:
      return "unknown";
  }
}

function objectType(schema, indent) {
  if (!schema.properties) {
    const of = schema.additionalProperties;
    return `Record<string, ${of && typeof of === "object" ? typeOf(of, indent) : "unknown"}>`;
  }
  const deeper = `${indent}  `;
  const required = new Set(schema.required ?? []);
  const members = Object.entries(schema.properties).map(([name, member]) => {
    const comment = member.description ? `${deeper}/** ${member.description} */\n` : "";
    const key = /^[A-Za-z_]\w*$/.test(name) ? name : literal(name);
    return `${comment}${deeper}${key}${required.has(name) ? "" : "?"}: ${typeOf(member, deeper)};\n`;
  });
  return members.length ? `{\n${members.join("")}${indent}}` : "Record<string, never>";
}

/** The text of types.ts for a schema. */
function protocolTypes(schema) {
  const definitions = Object.entries(schema.$defs);
  const types = definitions.map(([name, definition]) => {
    const comment = definition.description ? `/** ${definition.description} */\n` : "";
    return `${comment}export type ${typeName(name)} = ${typeOf(definition)};\n`;
  });
  const requests = definitions.filter(([, definition]) => definition.properties?.do);
  const answers = new Set(definitions.map(([name]) => name));
  const table = requests.map(([name]) => {
    const answer = answers.has(`${name} answer`) ? typeName(`${name} answer`) : "unknown";
    return `  ${name}: { request: ${typeName(name)}; answer: ${answer} };\n`;
  });
  const messages = definitions.filter(([name]) => name.endsWith(" message")).map(([name]) => typeName(name));
  return [
    "// Made from docs/studio.schema.json by scripts/protocol.mjs; not in git.\n",
    ...types,
    `/** What is sent without being asked for. */\nexport type Pushed = ${messages.join(" | ")};\n`,
    `/** Requests and the types of their answers, by name. */\nexport interface Requests {\n${table.join("")}}\n`,
  ].join("\n");
}

const text = protocolTypes(JSON.parse(readFileSync(SCHEMA, "utf-8")));
if (!existsSync(TYPES) || readFileSync(TYPES, "utf-8") !== text) writeFileSync(TYPES, text);
