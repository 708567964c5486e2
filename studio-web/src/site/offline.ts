import { t } from "../text";

/** Whether the page can be opened without a network. `begin` loads a newer version that is there, where no other tab has this one. */
export type Offline = { is: "ready" } | { is: "none"; why: string } | { is: "newer"; begin: () => void };

/** Stores this version of the page, and reports what comes of it. */
export async function keepOffline(report: (offline: Offline) => void, busy: (others: number) => void): Promise<void> {
  const none = (why: string) => report({ is: "none", why });
  if (!isSecureContext) return none(t("offlineInsecure"));
  if (!("serviceWorker" in navigator)) return none(t("offlineUnsupported"));
  navigator.serviceWorker.onmessage = ({ data }: MessageEvent<{ failed: string } | { others: number }>) => {
    if ("others" in data) busy(data.others);
    else none(t("offlineFailed", { why: data.failed }));
  };
  const newer = (worker: ServiceWorker) => {
    const begin = () => {
      worker.onstatechange = () => worker.state === "activated" && location.reload();
      worker.postMessage("begin");
    };
    report({ is: "newer", begin });
  };
  try {
    const registration = await navigator.serviceWorker.register("service.js");
    const follow = (worker: ServiceWorker | null) => {
      if (worker === null) return;
      worker.onstatechange = () => {
        if (worker.state === "activated") report({ is: "ready" });
        else if (worker.state === "installed" && registration.active !== null) newer(worker);
      };
    };
    registration.onupdatefound = () => follow(registration.installing);
    follow(registration.installing);
    if (registration.waiting !== null && registration.active !== null) newer(registration.waiting);
    else if (registration.active !== null) report({ is: "ready" });
    await navigator.storage.persist(); // refused: the browser removes it when it needs the room
  } catch (error) {
    none(t("offlineFailed", { why: error instanceof Error ? error.message : String(error) }));
  }
}
