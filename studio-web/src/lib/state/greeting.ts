import { language } from "../../text";
import type { Fields } from "../protocol/connection";

const TOKEN = "steptwin.token";

/** The first request. The token comes in the address after #token= once, and is kept for this tab. */
export function greetingOf(): Fields<"hello"> {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given !== null) {
    sessionStorage.setItem(TOKEN, given);
    history.replaceState(null, "", location.pathname);
  }
  return { token: sessionStorage.getItem(TOKEN), lang: language() };
}

/** The token from now on; none where it is empty. */
export function giveToken(token: string): void {
  if (token) sessionStorage.setItem(TOKEN, token);
  else sessionStorage.removeItem(TOKEN);
}

/** The address of another studio that takes the same token. */
export function withToken(url: string): string {
  const token = sessionStorage.getItem(TOKEN);
  return token === null ? url : `${url}#token=${encodeURIComponent(token)}`;
}

/** Of a request over HTTP. */
export function tokenHeaders(): Record<string, string> {
  const token = sessionStorage.getItem(TOKEN);
  return token === null ? {} : { authorization: `Bearer ${token}` };
}
