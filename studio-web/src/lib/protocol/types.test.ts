import { expect, test } from "vitest";
// @ts-expect-error a script without types
import { protocolTypes, schemaText, typesText } from "../../../scripts/protocol.mjs";

test("the types are those of the schema: npm run protocol", () => {
  expect(typesText()).toBe(protocolTypes(JSON.parse(schemaText())));
});
