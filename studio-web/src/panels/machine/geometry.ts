import type { Mechanics } from "../../lib/state/model";

export type Sensor = Mechanics["switches"][number];

export interface Zone {
  /** Fractions of the track. */
  from: number;
  to: number;
  pin: string;
}

export interface Track {
  low: number;
  high: number;
  hasStops: boolean;
}

/** What a track shows: the travel, or all switches and the places it has been at. */
export function trackOf({ travel, switches }: Mechanics, seen: readonly [number, number]): Track {
  if (travel !== null) {
    const [low, high] = travel as [number, number];
    return { low, high, hasStops: true };
  }
  const ends = switches.flatMap(({ low, high }) => [low, high]).filter((end) => end !== null);
  const [low, high] = [Math.min(...seen, ...ends), Math.max(...seen, ...ends)];
  const room = (high - low || 1) * 0.05;
  return { low: low - room, high: high + room, hasStops: false };
}

/** Where switches are on, on a track; a mark that comes again as often as it does there. */
export function zonesOf(switches: readonly Sensor[], { low, high }: Track): Zone[] {
  const MOST = 200;
  const part = (place: number) => Math.min(1, Math.max(0, (place - low) / (high - low)));
  return switches.flatMap(({ pin, low: from, high: to, period }): Zone[] => {
    if (period === null || from === null || to === null) {
      return [{ pin, from: part(from ?? low), to: part(to ?? high) }];
    }
    const first = Math.ceil((low - to) / period);
    const last = Math.min(first + MOST, Math.floor((high - from) / period));
    return Array.from({ length: Math.max(0, last - first + 1) }, (_, index) => {
      const shift = (first + index) * period;
      return { pin, from: part(from + shift), to: part(to + shift) };
    });
  });
}

/** Places around a dial, in turns. */
export function turnOf(unit: string): number {
  return unit === "degree" ? 360 : 1;
}

/** The arc of a circle with this radius from one angle to another in degrees, 0 above, clockwise. */
export function arcOf(radius: number, from: number, to: number): string {
  const at = (degrees: number) => {
    const radians = (degrees * Math.PI) / 180;
    return `${(radius * Math.sin(radians)).toFixed(2)} ${(-radius * Math.cos(radians)).toFixed(2)}`;
  };
  return `M${at(from)} A${radius} ${radius} 0 ${to - from > 180 ? 1 : 0} 1 ${at(to)}`;
}

/** Where a body is drawn, from and to as fractions of the track. */
export function bodyOf(
  { shape, length, size, low }: { shape: string; length: number; size: number; low: number },
  place: number,
): [number, number] {
  const part = (at: number) => Math.min(1, Math.max(0, (at - low) / length));
  return [shape === "rod" ? 0 : part(place - size), part(place)];
}
