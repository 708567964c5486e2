// Made from docs/studio.schema.json by `npm run protocol`; not to be changed by hand.

export type Request = DescribeRequest | ReadRequest | PinsRequest | StateRequest | EncodersRequest | FaultsRequest | FaultKindsRequest | TimeRequest | EndPointsRequest | FollowRequest | UnfollowRequest | SetRequest | PressRequest | ReleaseRequest | WriteRequest | SendRequest | RequestRequest | PowerCycleRequest | TurnRequest | CoupleRequest | FaultRequest | ClearFaultRequest | ExpectRequest | NoteRequest | SeeRequest | EnableRequest | MoveRequest | HomeRequest | JogRequest | StopRequest | StopAllRequest | ProgramRequest | DownloadRequest | PauseRequest | ResumeRequest | StepRequest | SnapshotRequest | SnapshotsRequest | RestoreRequest | DropSnapshotRequest | SaveRequest | DebugRequest | BreakpointRequest | ClearBreakpointRequest | BreakpointsRequest | StopOnRequest | StepProgramRequest | RunRequest | LookAtRequest | BranchRequest | StackRequest | ValuesRequest | EvaluateRequest | SetValueRequest | ProgramSourceRequest | WhyRequest | HelloRequest | ResyncRequest | WatchRequest | UnwatchRequest | TakeControlRequest | ReleaseControlRequest | RenewRequest | LetGoRequest | LookRequest | PastEventsRequest | GoBackRequest | ProgramsRequest | ProgramTextRequest | ProgramMemoryRequest | PortsRequest | ConnectRequest | DisconnectRequest | TrafficRequest | AuditRequest | CalculatorRequest | CalculateRequest | GearRequest | ConfigurationRequest | EditConfigurationRequest | ScanRequest | VerifyRequest | WorkRequest | CancelWorkRequest | RecordingsRequest | SaveRecordingRequest | ViewRecordingRequest | BranchesRequest | StartBranchRequest | EndBranchRequest | DrawingRequest | SaveDrawingRequest | GatewaysRequest | HistoryRequest | HistoryValuesRequest | CompareHistoryRequest | HistoryWritesRequest | CampaignsRequest | RunCampaignRequest | EndCampaignRequest | SettingsRequest | ShadowRequest | ShadowStateRequest;

/** Every request has exactly one. */
export type Answer = {
  /** Comes back with the answer. */
  id?: string | number | null;
  ok?: unknown;
  /** Commands and events are numbered together. */
  number?: number;
  /** Virtual time, as decimal text [ns] */
  time_ns?: string;
  error?: {
    code: "misuse" | "refusal" | "failure" | "internal";
    message: string;
  };
};

export type SubjectEvent = {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "plan";
  axis: string;
  /** Numbers for the position at any moment; docs/control.md has the formulas. */
  plan: {
    /** Virtual time, as decimal text [ns] */
    start_ns: string;
    base: number;
    final: number;
    segments: ((number | null)[] | {
      end_s: number | null;
      direction: number;
      way: (number | null)[];
      course: (number | null)[];
      half: number;
      end_p: number;
    })[];
    microstepping?: (number | null)[];
    divisions?: number[][];
  };
  origin: number | null;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "coordinate";
  axis: string;
  origin: number;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "sample";
  axis: string;
  position: number | null;
  unit: string;
  velocity: number | null;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "load";
  axis: string;
  pieces: {
    /** Virtual time, as decimal text [ns] */
    time_ns: string;
    follows: boolean;
    pulses: number;
  }[];
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "free";
  axis: string;
  /** Numbers for the position at any moment; docs/control.md has the formulas. */
  plan: {
    /** Virtual time, as decimal text [ns] */
    start_ns: string;
    base: number;
    final: number;
    segments: ((number | null)[] | {
      end_s: number | null;
      direction: number;
      way: (number | null)[];
      course: (number | null)[];
      half: number;
      end_p: number;
    })[];
    microstepping?: (number | null)[];
    divisions?: number[][];
  };
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "edge";
  pin: string;
  level: number;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "frame";
  client: string;
  direction: "in" | "out";
  /** Hexadecimal; empty for bytes that belong to no frame. */
  data: string;
  /** Its meaning. */
  words: string;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "write";
  /** Its place on the line. */
  client: string;
  /** Who is there: an address, the owner of a certificate, a path, or script. */
  source: string;
  /** What was written. */
  words: string;
  /** Empty where there is no answer. */
  outcome: "done" | "refusal" | "";
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "statement";
  program: string;
  line: number;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "status";
  code: string;
  axis: string | null;
  facts: Record<string, unknown>;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "note";
  note: string;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "report";
  code: string;
  what: string;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "button";
  button: string;
  pressed: boolean;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "input";
  what: string;
  value: unknown;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "fault";
  fault: string;
  words: string;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "restored";
  /** Its name; null without one. */
  snapshot: string | null;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "stopped";
  reason: string;
  what: string;
  breakpoints: number[];
  program: string | null;
  line: number | null;
  past: boolean;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "log";
  words: string;
  program: string;
  line: number;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "breakpoints";
  breakpoints: ({
    number: number;
    machine: string | null;
    program: string | null;
    line: number | null;
    label: string | null;
    value: string | null;
    condition: string | null;
    hits: string | null;
    log: string | null;
    problem: string | null;
  })[];
  stop_on: string[];
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
} | {
  /** Commands and events are numbered together; 0: a plan from before. */
  number: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  machine: string;
  kind: "pace";
  paused: boolean;
  speed: number | "max" | null;
  /** The command or the event that led to it. */
  cause: number | null;
  /** As text; it adds nothing to the rest. */
  text: string;
};

/** What there is; another one when devices come or go. */
export type Description = {
  name: string;
  axes: ({
    name: string;
    machine: string;
    axis: string;
    unit: string;
    points: string[];
    kind: string;
    travel: number[] | null;
    switches: ({
      pin: string;
      low: number | null;
      high: number | null;
      period: number | null;
    })[];
    pulses_per_unit: number;
  })[];
  buttons: string[];
  elements: ({
    name: string;
    kind: string;
    inputs: string[];
    outputs: string[];
    signals: ({
      name: string;
      unit: string;
      low: number | null;
      high: number | null;
    })[];
    drawing: {
      shape: string;
      length: number;
      places: string[];
      size: number;
      switches: ({
        pin: string;
        low: number | null;
        high: number | null;
        period: number | null;
      })[];
      low: number;
      across: number;
      across_low: number;
    } | null;
    function: string | null;
  })[];
  connections: ({
    source: string;
    target: string;
    inverted: boolean;
    delay_ns: number;
    join: string | null;
  })[];
  lines: ({
    name: string;
    kind: string;
    baud: number | null;
  })[];
  commands: string[];
  version: number;
  machines: ({
    name: string;
    /** Index of its data sheet. */
    datasheet: number;
    line: string | null;
    /** Slave address, or address of a chip. */
    unit: number | null;
    /** Which of enable, move, home, jog, stop, program it takes. */
    controls: string[];
    /** The same for each axis, and with axis null for the whole controller, with their arguments. */
    takes: ({
      command: string;
      axis: number | null;
      arguments: ({
        name: string;
        type: string;
        unit: string;
        limits: {
          low: number | null;
          high: number | null;
          is_low_excluded: boolean;
        } | null;
        values: (number | string)[];
        is_optional: boolean;
      })[];
    })[];
    /** A device: it gives samples instead of plans, and may move something. */
    real: boolean;
    /** Encoders of it may turn without an event of it. */
    moved: boolean;
  })[];
  datasheets: ({
    kind: string;
    title: string;
    variant: string;
    axes: ({
      number: number;
      name: string;
      unit: string;
      pulses_per_unit: number | null;
      round_p: number | null;
      positions: {
        low: number | null;
        high: number | null;
        is_low_excluded: boolean;
      } | null;
      distances: {
        low: number | null;
        high: number | null;
        is_low_excluded: boolean;
      } | null;
      velocities: {
        low: number | null;
        high: number | null;
        is_low_excluded: boolean;
      } | null;
      velocity_point: string | null;
      ramp_points: string[];
      limit_codes: number[] | null;
    })[];
    pins: ({
      name: string;
      direction: "input" | "output" | "input and output";
      is_analog: boolean;
      unit: string;
      limits: {
        low: number | null;
        high: number | null;
        is_low_excluded: boolean;
      };
      is_active_low: boolean;
    })[];
    points: ({
      path: string;
      meaning: string;
      type: string;
      unit: string;
      limits: {
        low: number | null;
        high: number | null;
        is_low_excluded: boolean;
      } | null;
      values: Record<string, string>;
      conditions: Record<string, "off" | "rest" | "moving" | "warning" | "error">;
      access: "r" | "w" | "rw";
      effect: "none" | "parameter" | "acts" | "moves";
      addresses: ({
        space: string;
        place: number | string;
        words: number;
        type: string;
      })[];
      source: string;
    })[];
    commands: ({
      name: string;
      code: string;
      meaning: string;
      arguments: ({
        name: string;
        type: string;
        unit: string;
        limits: {
          low: number | null;
          high: number | null;
          is_low_excluded: boolean;
        } | null;
        values: (number | string)[];
        is_optional: boolean;
      })[];
      effect: "none" | "parameter" | "acts" | "moves";
      source: string;
    })[];
    events: ({
      code: string;
      meaning: string;
      facts: ({
        name: string;
        type: "whole number" | "number" | "true or false" | "text" | "whole numbers" | "whole numbers by name";
        unit: string;
        is_optional: boolean;
      })[];
      severity: "information" | "warning" | "alarm";
      stops_motor: boolean | null;
    })[];
    program_actions: string[];
    end_switches_off: boolean;
    details: ({
      name: string;
      meaning: string;
      type: "whole number" | "number" | "true or false" | "text" | "whole numbers" | "whole numbers by name";
      unit: string;
      is_brief: boolean;
    })[];
    also_change: Record<string, string[]> | null;
  })[];
};

/** What is not known is null. The data sheet describes the details. */
export type State = {
  kind: string;
  variant: string;
  time_s: number | null;
  status: {
    code: number | null;
    text: string;
    level: "ok" | "warning" | "error";
  };
  program: {
    state: "stopped" | "running" | "waiting" | "paused" | null;
    text: string;
    file: string | null;
    line: number | null;
    statement: string | null;
    variables: Record<string, number>;
  };
  axes: ({
    number: number;
    name: string;
    unit: string;
    position: number | null;
    velocity: number | null;
    moving: boolean | null;
    enabled: boolean | null;
    encoder: number | null;
    status: {
      code: number | null;
      text: string;
      level: "ok" | "warning" | "error";
    };
  })[];
  pins: Record<string, number | null>;
  details: Record<string, boolean | number | string | number[] | Record<string, number> | null>;
};

/** What there is. Answer: version, name, machines with the numbers of their datasheets, axes, buttons, elements, connections, lines, commands. */
export type DescribeRequest = {
  do: "describe";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** The present values of points. Answer: a list of point, value, unit, quality ('good', or 'unknown' with value null). */
export type ReadRequest = {
  do: "read";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Points, such as table.M1.position, table.IN3, x.position, time. */
  points: string[];
};

/** The levels of all pins: 0, 1, volts. Answer: {"MACHINE.PIN": LEVEL, ...}. */
export type PinsRequest = {
  do: "pins";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine; all of them without. */
  machine?: string | null;
};

/** The present state of a machine. Answer: the state, alike for all kinds. */
export type StateRequest = {
  do: "state";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** Only these parts: status, program, pins, details, names of axes. */
  parts?: string[] | null;
};

/** The encoders of a machine. Answer: a list of axis, counts, turned_by. */
export type EncodersRequest = {
  do: "encoders";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
};

/** The faults that are set. Answer: a list of name, fault, seen (occasions), happened (how often). */
export type FaultsRequest = {
  do: "faults";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** The kinds of faults. Answer: a list of name, layer, occasion, meaning, lines, parameters: name, meaning, permitted, default, words, required. */
export type FaultKindsRequest = {
  do: "fault_kinds";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** The present moment, and how time goes. Answer: world, time_ns, time_s, paused, speed, stopped. */
export type TimeRequest = {
  do: "time";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Where programs can connect. Answer: a list of kind, protocol and the address. */
export type EndPointsRequest = {
  do: "end_points";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Events from now on, as messages with the id of this request. Answer: plans: the present plan of every axis that is followed, as events. */
export type FollowRequest = {
  do: "follow";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Kinds of events; all but frames without. */
  kinds?: ("plan" | "coordinate" | "sample" | "load" | "free" | "edge" | "frame" | "write" | "statement" | "status" | "note" | "report" | "button" | "input" | "fault" | "pace" | "restored" | "stopped" | "log" | "breakpoints")[] | null;
  /** Names of machines, lines, or 'world'; all without. */
  machines?: string[] | null;
  /** Numbers of axes as text; events of other axes are left out. */
  axes?: string[] | null;
  /** Events that wait to be sent; beyond it the oldest are dropped and counted. */
  bound?: number | null;
};

/** No more events. Answer: null. */
export type UnfollowRequest = {
  do: "unfollow";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The id of the request. */
  follow: string | number;
};

/** Inputs take levels, all of them or none. Answer: null. */
export type SetRequest = {
  do: "set";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** 0, 1, volts. */
  levels: Record<string, number>;
};

/** Press a button. Answer: null. */
export type PressRequest = {
  do: "press";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a button. */
  button: string;
  /** How long; until it is released without. [ns] */
  for_ns?: string | number | null;
};

/** Release a button. Answer: null. */
export type ReleaseRequest = {
  do: "release";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a button. */
  button: string;
};

/** Registers take values by name, as a Modbus master writes them. Answer: null. */
export type WriteRequest = {
  do: "write";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Registers by MACHINE.REGISTER. [units of the data sheet] */
  values: Record<string, number>;
};

/** Characters go to a line. Answer: null. */
export type SendRequest = {
  do: "send";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a line. */
  line: string;
  /** Characters, one byte each. */
  text: string;
};

/** A Modbus request on a line. Answer: pdu: that of the answer, null where it has not come at once; a frame event has it then. */
export type RequestRequest = {
  do: "request";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a line. */
  line: string;
  /** The slave address. */
  unit: number;
  /** Function code and data. */
  pdu: string;
  /** How long the answer is waited for. [ns] */
  within_ns?: string | number | null;
};

/** Switch a machine off and on again. Answer: null. */
export type PowerCycleRequest = {
  do: "power_cycle";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
};

/** Turn the encoder shaft of an axis. Answer: null. */
export type TurnRequest = {
  do: "turn";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of an axis. */
  axis: number;
  /** By how much. [encoder counts] */
  counts: number;
};

/** What turns the encoder shaft of an axis without mechanics. Answer: null. */
export type CoupleRequest = {
  do: "couple";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of an axis. */
  axis: number;
  /** What turns it. */
  to: "drive" | "free" | "blocked";
};

/** Something goes wrong from now on. Answer: name. */
export type FaultRequest = {
  do: "fault";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Which. */
  fault: string;
};

/** Remove a fault. Answer: null. */
export type ClearFaultRequest = {
  do: "clear_fault";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a fault. */
  name: string;
};

/** A condition must hold; else that is reported. Answer: holds. */
export type ExpectRequest = {
  do: "expect";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Which. */
  condition: string;
};

/** A text for the record. Answer: null. */
export type NoteRequest = {
  do: "note";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The text. */
  text: string;
};

/** A record of a vision system comes to a controller. Answer: null. */
export type SeeRequest = {
  do: "see";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of the record. */
  number: number;
  /** The x of the record. */
  x: number;
  /** The y of the record. */
  y: number;
  /** The angle of the record. */
  angle: number;
};

/** Switch a drive on or off. Answer: null. */
export type EnableRequest = {
  do: "enable";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of an axis. */
  axis: number;
  /** Whether it is to be on. */
  on?: boolean | null;
};

/** Begin to move. Answer: null. */
export type MoveRequest = {
  do: "move";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of an axis. */
  axis: number;
  /** To this position. [units of the data sheet] */
  to?: number | null;
  /** By this distance. [units of the data sheet] */
  by?: number | null;
};

/** Begin to home. Answer: null. */
export type HomeRequest = {
  do: "home";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of an axis. */
  axis: number;
  /** Its sign chooses the switch. [units of the data sheet/s] */
  velocity: number;
};

/** Begin to move without end. A lease, which has to be renewed. */
export type JogRequest = {
  do: "jog";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of an axis. */
  axis: number;
  /** Velocity with its sign. [units of the data sheet/s] */
  velocity: number;
};

/** Stop as fast as the controller does, with a ramp or without. The program of a MIC488 goes on. Answer: program: what the program does now: running (it goes on), paused, stopped; null where that is not known. */
export type StopRequest = {
  do: "stop";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of an axis; all without. */
  axis?: number | null;
};

/** Stop everything: all axes and jogs, programs (paused where the controller can pause one, else ended), and scripts. Fails if a controller could not be stopped; the others are. Answer: machines: the controllers that were stopped; scripts: those that were ended. */
export type StopAllRequest = {
  do: "stop_all";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Start, pause or stop the program of a machine. Answer: null. */
export type ProgramRequest = {
  do: "program";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** What to do. */
  action: "start" | "pause" | "stop";
};

/** Put a text into the program memory of a controller: a MIC488 has it at once, to an M1486 it is typed, and runs then. Answer: null. */
export type DownloadRequest = {
  do: "download";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** Where, such as program 0, positions 0 (MIC488, by bank), program (M1486). */
  place: string;
  /** The text. One with errors is refused with what is wrong. */
  text: string;
};

/** Time stands. Answer: as time. */
export type PauseRequest = {
  do: "pause";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Time goes on. Answer: as time. */
export type ResumeRequest = {
  do: "resume";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Virtual seconds in a second. */
  speed?: number | "max" | null;
};

/** Time goes on for a duration, to a moment, or to the next thing that happens by itself, and stands then. Answer: as time; events, missed, came (whether the condition ended it), idle, statements; to_ns where a request has to go on. */
export type StepRequest = {
  do: "step";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** How long. [ns] */
  for_ns?: string | number | null;
  /** To which moment. [ns] */
  to_ns?: string | number | null;
  /** A condition that ends it. */
  until?: string | null;
};

/** Keep the present state in the process, to go back to it; one of the same name is replaced. Answer: name, time_ns. */
export type SnapshotRequest = {
  do: "snapshot";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Its name; a number without. */
  name?: string | null;
};

/** The states that are kept. Answer: a list of name, time_ns. */
export type SnapshotsRequest = {
  do: "snapshots";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Go back to a state that is kept. Time stands there; what happened since is undone. Answer: as time. */
export type RestoreRequest = {
  do: "restore";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a snapshot. */
  name: string;
};

/** Keep a state no longer. Answer: null. */
export type DropSnapshotRequest = {
  do: "drop_snapshot";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a snapshot. */
  name: string;
};

/** Write the session, or the last records, to a file. Answer: as time; file, inputs, digest, or files, records for the last records. */
export type SaveRequest = {
  do: "save";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Absolute path. */
  file: string;
};

/** What can be debugged: controllers with their programs, the lines in which breakpoints can be, labels. Answer: machines, events, scopes, time_ns, present_ns, begin_ns (the oldest moment that can be gone to), past, going (whether time goes on). */
export type DebugRequest = {
  do: "debug";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Time stops before a line is executed, at a label or interrupt of any program, or when a value changes. Answer: number, problem (why it is nowhere; null), lines of the statements, and what was given. */
export type BreakpointRequest = {
  do: "breakpoint";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine?: string | null;
  /** A program of it, such as program 0 (MIC488, by bank), program (M1486). */
  program?: string | null;
  /** The first statement in this line or after it. */
  line?: number | null;
  /** A label or interrupt: MAIN, INT_IN3, label 2. */
  label?: string | null;
  /** A name in an expression. */
  value?: string | null;
  /** An expression that must hold. */
  condition?: string | null;
  /** At which of the times that it holds: 5, >= 5, % 5. */
  hits?: string | null;
  /** Instead of a stop, followers receive this text, with the values of what is in braces. */
  log?: string | null;
};

/** Remove a breakpoint. Answer: null. */
export type ClearBreakpointRequest = {
  do: "clear_breakpoint";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Its number. */
  breakpoint: number;
};

/** What time stops at, and why the debugger stands. Answer: breakpoints: a list of number, problem (why it is nowhere; null), lines of the statements, and what was given; stop_on; stop: as the event stopped, null while time goes on. */
export type BreakpointsRequest = {
  do: "breakpoints";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Events of controllers at which time stops; those named before are replaced. Answer: null. */
export type StopOnRequest = {
  do: "stop_on";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Which; none with an empty list. */
  events: ("program-error" | "wrong-data" | "position-error" | "limit")[];
};

/** Time goes on to the next statement, to the one after a call (over), or to the one after the call in which the program is (out); or the debugger goes to the statement before (back). The event stopped says where. Answer: time_ns, present_ns, begin_ns (the oldest moment that can be gone to), past, going (whether time goes on). */
export type StepProgramRequest = {
  do: "step_program";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** Which step. */
  way: "in" | "over" | "out" | "back";
};

/** Go on from where the debugger stands, through the past to the present and on, or back, to the next reason to stop. Answer: time_ns, present_ns, begin_ns (the oldest moment that can be gone to), past, going (whether time goes on). */
export type RunRequest = {
  do: "run";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Which way. */
  way?: "forwards" | "backwards" | null;
};

/** The debugger goes to a moment of the past; the world stands at the present. Answer: time_ns, present_ns, begin_ns (the oldest moment that can be gone to), past, going (whether time goes on). */
export type LookAtRequest = {
  do: "look_at";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Which moment. [ns] */
  to_ns: string | number;
};

/** The world goes back to the moment of the past at which the debugger stands; what came later has not happened. Answer: time_ns, present_ns, begin_ns (the oldest moment that can be gone to), past, going (whether time goes on). */
export type BranchRequest = {
  do: "branch";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** The statement that comes next, or is waited in, then those to which it returns; empty where no program runs. Answer: a list of name (the label before it), program, source, line, column, end_line, end_column. */
export type StackRequest = {
  do: "stack";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
};

/** A group of values where the debugger stands. Answer: a list of name, value (as text, with its unit), number (null where it is none), settable, expression (what evaluates to it). */
export type ValuesRequest = {
  do: "values";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** Which group. */
  scope: "Variables" | "Axes" | "Pins" | "Controller" | "Registers" | "World";
};

/** The value of an expression where the debugger stands. Answer: name, value (as text, with its unit), number (null where it is none), settable, expression (what evaluates to it). */
export type EvaluateRequest = {
  do: "evaluate";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** Names of the program and signals of the world, as in docs/debugger.md. */
  expression: string;
};

/** A variable, an input or a register takes a value, at the present only. Answer: name, value (as text, with its unit), number (null where it is none), settable, expression (what evaluates to it). */
export type SetValueRequest = {
  do: "set_value";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** Which. */
  name: string;
  /** Its value. */
  expression: string;
};

/** The text of a program. Answer: program, source (the name of its file), text. */
export type ProgramSourceRequest = {
  do: "program_source";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** Which, such as program 0. */
  program: string;
};

/** The chain of causes of a value, of a condition or of a wait, from the past that is kept. Answer: question, at_ns, state (what is true), since_ns (null: it has not changed), links: a list of time_ns, subject and text, from the effect to its causes; complete, known_from_ns, cut (whether the chain ends there), text (all of it in lines). */
export type WhyRequest = {
  do: "why";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** A signal, a condition, or the name of a controller: what its program waits for. */
  question?: string | null;
  /** At which moment; now without. [ns] */
  at_ns?: string | number | null;
};

/** The first request of a connection. Its answer is followed by the whole state. */
export type HelloRequest = {
  do: "hello";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Where the studio asks for one. */
  token?: string | null;
  /** What others see. */
  name?: string | null;
  /** Language of the page, such as en or pl. */
  lang?: string | null;
};

/** The whole state once more, with seq 0. */
export type ResyncRequest = {
  do: "resync";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Values of points, sent whenever they have changed. */
export type WatchRequest = {
  do: "watch";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Points, as for read. */
  points: string[];
  /** At most this often. [1/s] */
  rate?: number | null;
};

/** No more values. */
export type UnwatchRequest = {
  do: "unwatch";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The number in the answer to watch. */
  watch: number;
};

/** Take control. A viewer that acts while control is free takes it, too. */
export type TakeControlRequest = {
  do: "take_control";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Also from a viewer who holds it. */
  over?: boolean | null;
};

/** Hold control no more; jogs of this viewer end. */
export type ReleaseControlRequest = {
  do: "release_control";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** A jog goes on for as long as its lease lasts from now. */
export type RenewRequest = {
  do: "renew";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The number in the answer to jog. */
  lease: number;
};

/** A jog ends: its axis stops with its ramp. */
export type LetGoRequest = {
  do: "let_go";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The number in the answer to jog. */
  lease: number;
};

/** Look at a moment of the past while the world goes on. The message past and values of all watches follow. Until the present is looked at again, state, read, pins, encoders, faults and programs are of that moment, and nothing can be changed but by stop. */
export type LookRequest = {
  do: "look";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Which moment; the present without. [ns] */
  to_ns?: string | number | null;
};

/** What happened between two moments of the past, at most a minute apart. plans, state and faults are those of the first moment. Of more than 10000 events the last ones, without these; from_ns is then the moment of the first event. */
export type PastEventsRequest = {
  do: "past_events";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The first moment, or the begin of the past that is kept. [ns] */
  from_ns: string | number;
  /** The last moment. [ns] */
  to_ns: string | number;
  /** Kinds of events, as for follow. */
  kinds?: ("plan" | "coordinate" | "sample" | "load" | "free" | "edge" | "frame" | "write" | "statement" | "status" | "note" | "report" | "button" | "input" | "fault" | "pace" | "restored" | "stopped" | "log" | "breakpoints")[] | null;
};

/** The world itself goes back to the moment that this viewer looks at; time stands there. What happened since is undone. */
export type GoBackRequest = {
  do: "go_back";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** The program memories of controllers: each place, and what is there. */
export type ProgramsRequest = {
  do: "programs";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** One of these texts, with what the checker of its language finds in it. */
export type ProgramTextRequest = {
  do: "program_text";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Of a controller. */
  machine: string;
  /** As in the answer to programs. */
  place: string;
};

/** What a text would take of the program memory at a place, and what is permitted. Empty for a text with errors. */
export type ProgramMemoryRequest = {
  do: "program_memory";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Of a controller. */
  machine: string;
  /** As in the answer to programs. */
  place: string;
  /** The text; it is not downloaded. */
  text: string;
};

/** The serial ports of the computer on which the studio runs, and the pseudo terminals of running twins. */
export type PortsRequest = {
  do: "ports";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** A device becomes a machine here. Nothing moves by it, and no setting is changed. */
export type ConnectRequest = {
  do: "connect";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** As after --device: /dev/ttyUSB0,unit=2, tcp://192.168.0.9,config=machine.cfg. */
  address: string;
  /** Of the machine; its kind without one. */
  name?: string | null;
};

/** A device is no machine here any more: jogs end, other motions and its program go on. */
export type DisconnectRequest = {
  do: "disconnect";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Of a device. */
  machine: string;
};

/** How much each line of the world has carried since its beginning. Counted at present, also while the past is looked at. */
export type TrafficRequest = {
  do: "traffic";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Who did what, the newest last. */
export type AuditRequest = {
  do: "audit";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Entries. */
  most?: number | null;
};

/** The quantities of a move of an axis, and the times of which one may be given in place of a quantity. */
export type CalculatorRequest = {
  do: "calculator";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of an axis. */
  axis: number;
};

/** A move from rest to rest, as the controller would plan it: its times, or with one time the quantity that is left out. */
export type CalculateRequest = {
  do: "calculate";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The number of an axis. */
  axis: number;
  /** Quantities by name, and a time at most. */
  given: Record<string, number>;
  /** What a time determines; the one that is left out without. */
  find?: string | null;
};

/** Pulses in each unit (GEAR), from the mechanics. */
export type GearRequest = {
  do: "gear";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Full steps in a revolution of the motor. */
  motor_steps?: number | null;
  /** Pulses in a full step. */
  microsteps: number;
  /** Revolutions of the motor in one of what it drives. */
  ratio?: number | null;
  /** Travel in one revolution of what is driven; it turns without. [mm] */
  lead?: number | null;
};

/** The configuration of a controller as a form: sections, settings with meaning, unit and range, what is wrong. It is that of its file; without one, what its registers show. */
export type ConfigurationRequest = {
  do: "configuration";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
};

/** The form of a text of such a file, with other values in it. Nothing is written. */
export type EditConfigurationRequest = {
  do: "edit_configuration";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** The name of a machine. */
  machine: string;
  /** The file. */
  text: string;
  /** Values by SECTION.KEY, such as Axis0.Gear. */
  changes?: Record<string, string> | null;
};

/** Search lines for devices, as steptwin scan does: nothing moves, and no setting is changed. The answer to work has what is found. */
export type ScanRequest = {
  do: "scan";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Ports and addresses; all serial ports without. */
  places?: string[] | null;
  /** any, mic488 or m1486. */
  kind?: string | null;
  /** Slave addresses of MIC488, such as 1-16. */
  units?: string | null;
  /** Baud rates of serial ports, such as 9600,38400; the usual ones without. */
  baud?: string | null;
  /** Time to wait for each answer, besides that on the wire. [s] */
  timeout?: number | null;
};

/** Check a device that is not connected, as steptwin verify does. The answer to work has the report. */
export type VerifyRequest = {
  do: "verify";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** As of connect. */
  address: string;
  /** Permit checks that write settings and put them back. */
  write?: boolean | null;
};

/** The search or the checks that were begun last. */
export type WorkRequest = {
  do: "work";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** A search ends with what it has found, checks after the present one. */
export type CancelWorkRequest = {
  do: "cancel_work";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** What is recorded of the world, and which sessions are saved. */
export type RecordingsRequest = {
  do: "recordings";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Save the session up to now as a file beside the world. Nothing changes in the world. */
export type SaveRecordingRequest = {
  do: "save_recording";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Of the file, without .json; the world and the time of day without. */
  name?: string | null;
};

/** Open a saved session as a page of its own, as steptwin studio FILE --view does; at a loopback address only. */
export type ViewRecordingRequest = {
  do: "view_recording";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Of a saved session. */
  name: string;
};

/** The branches of the world that are open. */
export type BranchesRequest = {
  do: "branches";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Begin another world, without ports, in the state of a moment of the past. It is a studio of its own, in which time stands at first. Nothing changes in the world here. */
export type StartBranchRequest = {
  do: "start_branch";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Which moment; the present without. [ns] */
  at_ns?: string | number | null;
};

/** End a branch; what is in it is lost. */
export type EndBranchRequest = {
  do: "end_branch";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Its number. */
  branch: number;
};

/** Where the page draws axes and elements: x and y of the upper left corner in pixels, by name. Empty: by itself. */
export type DrawingRequest = {
  do: "drawing";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Write these places into the description of the world, as [[drawing]], in the place of those there. */
export type SaveDrawingRequest = {
  do: "save_drawing";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** By the names of axes and elements; 'tool path', 'all buttons'. None: it is drawn by itself. */
  places: Record<string, number[]>;
};

/** The gateways of the world, and who uses them. */
export type GatewaysRequest = {
  do: "gateways";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Runs and points that the history beside the world has kept; null where there is none. */
export type HistoryRequest = {
  do: "history";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Values of points in a stretch of a run that has been kept, for a picture: of motions the ends of their parts, and about 800 positions between; at most 4000 of each point. */
export type HistoryValuesRequest = {
  do: "history_values";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Names as in the answer to history, at most 8. */
  points: string[];
  /** Number of the run; -1 is the last one. */
  run?: number | null;
  /** Begin of the stretch, since that of the run. [s] */
  from_s?: number | null;
  /** End of the stretch; that of the run without. [s] */
  to_s?: number | null;
};

/** The points that differ between the same stretch of two runs, the greatest difference first. */
export type CompareHistoryRequest = {
  do: "compare_history";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Number of a run; -1 is the last one. */
  run: number;
  /** Number of the run that it is compared with. */
  other: number;
  /** Only these; all without. */
  points?: string[] | null;
  /** Begin of the stretch, since that of the run. [s] */
  from_s?: number | null;
  /** End of the stretch; that of the run without. [s] */
  to_s?: number | null;
};

/** What programs have written over lines and clients have commanded in a stretch of a run; the last 200. */
export type HistoryWritesRequest = {
  do: "history_writes";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Number of the run; -1 is the last one. */
  run?: number | null;
  /** Begin of the stretch, since that of the run. [s] */
  from_s?: number | null;
  /** End of the stretch; that of the run without. [s] */
  to_s?: number | null;
};

/** The campaigns of this world: files with a table [campaign] in the folder of its description or just below it. */
export type CampaignsRequest = {
  do: "campaigns";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
};

/** Run a campaign, or what is left of it, in processes beside the studio. Nothing changes in the world here. */
export type RunCampaignRequest = {
  do: "run_campaign";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** As in the answer to campaigns. */
  campaign: string;
};

/** End a campaign; run_campaign goes on with it. */
export type EndCampaignRequest = {
  do: "end_campaign";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** As in the answer to campaigns. */
  campaign: string;
};

/** What can be read and written in a device, as the text that is kept before the first write. */
export type SettingsRequest = {
  do: "settings";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Of a device. */
  machine: string;
};

/** Put a twin beside a device at rest, which is given the same commands from then on, or remove it. Of the device it only reads. */
export type ShadowRequest = {
  do: "shadow";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Of a device. */
  machine: string;
  /** Whether there is to be one. */
  on?: boolean | null;
};

/** How a device and the twin beside it differ; null without one. */
export type ShadowStateRequest = {
  do: "shadow_state";
  /** Comes back with the answer. */
  id?: string | number | null;
  version?: 1;
  /** Of a device. */
  machine: string;
  /** Only samples later than this, from the beginning of the shadow. [ns] */
  after_ns?: string | number | null;
};

export type JogAnswer = {
  lease: number;
  /** Renew it in a third of this. [ms] */
  lasts_ms: number;
};

export type HelloAnswer = {
  viewer: number;
  name: string;
  role: "viewer" | "operator" | "engineer";
};

export type ResyncAnswer = null;

export type WatchAnswer = {
  watch: number;
  /** In the order of their indices. */
  points: {
    point: string;
    unit: string;
  }[];
};

export type UnwatchAnswer = null;

export type TakeControlAnswer = null;

export type ReleaseControlAnswer = null;

export type RenewAnswer = {
  lease: number;
  /** Renew it in a third of this. [ms] */
  lasts_ms: number;
};

export type LetGoAnswer = null;

export type LookAnswer = {
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  /** Virtual time, as decimal text [ns] */
  from_ns: string;
} | null;

export type PastEventsAnswer = {
  /** Virtual time, as decimal text [ns] */
  from_ns: string;
  /** Virtual time, as decimal text [ns] */
  to_ns: string;
  /** As in hello. */
  state: Record<string, State>;
  faults: Record<string, unknown>[];
  plans: SubjectEvent[];
  events: SubjectEvent[];
};

export type GoBackAnswer = null;

export type ProgramsAnswer = ({
  machine: string;
  /** Unlike all others of the machine, such as program 0. */
  place: string;
  /** Of the file. */
  name: string;
  language: "wbc" | "csv" | "m1486";
  /** At the editor server. */
  address: string;
  /** Whether nothing is there yet. */
  empty: boolean;
  running: boolean;
  /** Of the present statement, from 1, while it runs or is paused; null where that is not known. */
  line: number | null;
})[];

export type ProgramTextAnswer = {
  machine: string;
  /** Unlike all others of the machine, such as program 0. */
  place: string;
  /** Of the file. */
  name: string;
  language: "wbc" | "csv" | "m1486";
  /** At the editor server. */
  address: string;
  /** Whether nothing is there yet. */
  empty: boolean;
  running: boolean;
  /** Of the present statement, from 1, while it runs or is paused; null where that is not known. */
  line: number | null;
  text: string;
  diagnostics: ({
    line: number;
    column: number;
    end_line: number;
    end_column: number;
    severity: "error" | "warning" | "note";
    code: string;
    message: string;
    hint: string | null;
  })[];
};

export type ProgramMemoryAnswer = ({
  what: string;
  used: number;
  /** Null: the memory of the other parts limits it. */
  most: number | null;
  unit: string;
})[];

export type PortsAnswer = {
  address: string;
  what: string;
}[];

export type ConnectAnswer = {
  machine: string;
};

export type DisconnectAnswer = null;

export type TrafficAnswer = {
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  lines: {
    line: string;
    /** Network connections, and serial ports and pseudo terminals that are open. */
    clients: number;
    /** Whole requests; of characters, lines. */
    requests: number;
    /** Exceptions and lost requests; of characters, those lost on the wire. */
    errors: number;
    /** Bytes that belonged to no frame. */
    unframed: number;
  }[];
};

export type AuditAnswer = ({
  /** Wall clock, ISO 8601. */
  at: string;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  viewer: string;
  role: "viewer" | "operator" | "engineer";
  do: string;
  fields: Record<string, unknown>;
  outcome: "done" | "misuse" | "refusal" | "failure" | "internal";
})[];

export type CalculatorAnswer = {
  title: string;
  quantities: ({
    name: string;
    meaning: string;
    unit: string;
    /** Pulses (per s, per s²) in one of its unit. */
    pulses: number;
    limits: {
      low: number | null;
      high: number | null;
      is_low_excluded: boolean;
    };
    choices: number[];
    default: number | null;
    /** The quantity whose value it has where none is given. */
    same_as: string | null;
    /** Register or command that sets it; empty where it is given with a motion. */
    code: string;
    /** The fact of the state that it is. */
    detail: string;
    source: string;
  })[];
  times: ({
    name: string;
    meaning: string;
    unit: string;
    /** Pulses (per s, per s²) in one of its unit. */
    pulses: number;
    limits: {
      low: number | null;
      high: number | null;
      is_low_excluded: boolean;
    };
    choices: number[];
    default: number | null;
    /** The quantity whose value it has where none is given. */
    same_as: string | null;
    /** Register or command that sets it; empty where it is given with a motion. */
    code: string;
    /** The fact of the state that it is. */
    detail: string;
    source: string;
  })[];
};

export type CalculateAnswer = {
  title: string;
  found: string | null;
  /** Of what was found, before it was made what the controller takes. */
  exact: number | null;
  values: Record<string, number>;
  units: Record<string, string>;
  times: Record<string, number>;
  peak: number;
  /** Whether the peak is the velocity. */
  reaches: boolean;
  parts: {
    name: string;
    start_s: number;
    duration_s: number;
    from_velocity: number;
    to_velocity: number;
    distance: number;
  }[];
  formulas: {
    name: string;
    text: string;
    source: string;
  }[];
  notes: string[];
  settings: {
    name: string;
    code: string;
    detail: string;
    value: number;
    unit: string;
  }[];
  /** Time [s], position, velocity. */
  curve: number[][];
};

export type GearAnswer = Record<string, number>;

export type ConfigurationAnswer = {
  /** Of the file. */
  name: string;
  text: string;
  sections: ({
    name: string;
    title: string;
    settings: ({
      name: string;
      meaning: string;
      unit: string;
      /** As it is written; empty where it is not in the file. */
      text: string;
      value: number;
      default: number;
      limits: {
        low: number | null;
        high: number | null;
        is_low_excluded: boolean;
      };
      is_whole: boolean;
      choices: Record<string, string>;
      /** The point that has it at run time; empty without one. */
      point: string;
      source: string;
    })[];
  })[];
  diagnostics: ({
    line: number;
    column: number;
    end_line: number;
    end_column: number;
    severity: "error" | "warning" | "note";
    code: string;
    message: string;
    hint: string | null;
  })[];
  /** false: no file; the text has what the registers of the controller show, and no more. */
  is_file: boolean;
  /** What points get from keys of the text, in the units that the controller has now. Without those that cannot be converted into them. */
  points: Record<string, number>;
};

export type EditConfigurationAnswer = {
  /** Of the file. */
  name: string;
  text: string;
  sections: ({
    name: string;
    title: string;
    settings: ({
      name: string;
      meaning: string;
      unit: string;
      /** As it is written; empty where it is not in the file. */
      text: string;
      value: number;
      default: number;
      limits: {
        low: number | null;
        high: number | null;
        is_low_excluded: boolean;
      };
      is_whole: boolean;
      choices: Record<string, string>;
      /** The point that has it at run time; empty without one. */
      point: string;
      source: string;
    })[];
  })[];
  diagnostics: ({
    line: number;
    column: number;
    end_line: number;
    end_column: number;
    severity: "error" | "warning" | "note";
    code: string;
    message: string;
    hint: string | null;
  })[];
  /** false: no file; the text has what the registers of the controller show, and no more. */
  is_file: boolean;
  /** What points get from keys of the text, in the units that the controller has now. Without those that cannot be converted into them. */
  points: Record<string, number>;
};

export type ScanAnswer = null;

export type VerifyAnswer = null;

export type WorkAnswer = {
  work: "scan" | "verify";
  is_running: boolean;
  /** What is tried at present. */
  doing: string;
  step: number;
  steps: number;
  tried: string[];
  found: {
    /** As connect takes it. */
    device: string;
    what: string;
  }[];
  problems: string[];
  report: {
    format: string;
    /** Version. */
    steptwin: string;
    time: string;
    device: Record<string, unknown>;
    permitted: string;
    is_complete: boolean;
    counts: Record<string, number>;
    results: ({
      /** Of the interpretation. */
      id: string;
      outcome: "confirmed" | "refuted" | "not checked";
      what: string;
      /** It was not checked. */
      why: string;
      probes: {
        what: string;
        expected: string;
        came: string;
        holds: boolean;
      }[];
    })[];
  } | null;
} | null;

export type CancelWorkAnswer = null;

export type RecordingsAnswer = {
  /** Inputs from outside since the beginning; null: none is recorded. */
  session: {
    /** Virtual time, as decimal text [ns] */
    until_ns: string;
    inputs: number;
    most_inputs: number;
    bytes: number;
    most_bytes: number;
    /** Whether it has ended for want of room. */
    is_full: boolean;
    /** Where it is written at the end of the studio. */
    file: string | null;
  } | null;
  /** What look can show. */
  past: {
    /** Virtual time, as decimal text [ns] */
    from_ns: string;
    states: number;
    inputs: number;
    most_inputs: number;
  } | null;
  /** What happened, as --trace keeps it. */
  trace: {
    kind: "none" | "ring" | "file";
    file: string | null;
    records: number | null;
    most_records: number | null;
    /** Of the oldest record of a ring. */
    from_ns: string | null;
  };
  /** Where sessions are saved. */
  folder: string;
  /** Sessions there, the newest first. */
  saved: {
    /** Of the file, without .json. */
    name: string;
    bytes: number;
    /** Wall clock, ISO 8601. */
    saved: string;
    /** Virtual time, as decimal text [ns] */
    until_ns: string;
  }[];
  /** What GET /api/recordings/NAME.FORMAT makes of them. */
  formats: string[];
};

export type SaveRecordingAnswer = {
  /** Of the file, without .json. */
  name: string;
  bytes: number;
  /** Wall clock, ISO 8601. */
  saved: string;
  /** Virtual time, as decimal text [ns] */
  until_ns: string;
};

export type ViewRecordingAnswer = {
  url: string;
};

export type BranchesAnswer = {
  branch: number;
  /** Where it began. Virtual time, as decimal text [ns] */
  from_ns: string;
  /** Of its page; the token there is the one of here. */
  url: string;
}[];

export type StartBranchAnswer = {
  branch: number;
  /** Where it began. Virtual time, as decimal text [ns] */
  from_ns: string;
  /** Of its page; the token there is the one of here. */
  url: string;
};

export type EndBranchAnswer = null;

export type DrawingAnswer = {
  places: Record<string, number[]>;
  /** Of the description; null: it is in none. */
  file: string | null;
};

export type SaveDrawingAnswer = {
  /** What has been written; null: it cannot be written. */
  file: string | null;
  /** For a file. */
  name: string;
  /** The description with these places. */
  text: string;
};

export type GatewaysAnswer = ({
  /** The name of its table: opcua, history. */
  kind: string;
  protocol: string;
  /** Its address. */
  place: string;
  is_up: boolean;
  /** Its state in words, such as why it is not up. */
  text: string;
  /** How many values it shows; null where that is no fixed number. */
  shown: number | null;
  clients: {
    name: string;
    /** Where it is, as far as that is known. */
    place: string;
    role: string;
    /** Values that it is sent when they change, by the names of the protocol. */
    follows: string[];
  }[];
})[];

export type HistoryAnswer = {
  database: string;
  runs: {
    run: number;
    subject: string;
    /** Whether its moments are virtual ones, of twins. */
    is_virtual: boolean;
    /** Wall clock, ISO 8601. */
    began: string;
    length_s: number;
    /** False while it goes on, and where its process was killed. */
    is_over: boolean;
  }[];
  points: {
    point: string;
    unit: string;
    is_text: boolean;
  }[];
} | null;

export type HistoryValuesAnswer = {
  run: number;
  from_s: number;
  to_s: number;
  series: ({
    point: string;
    unit: string;
    is_text: boolean;
    /** Whether values change between moments, too; otherwise each holds until the next. */
    is_motion: boolean;
    /** Whether it has been read in equal steps, because there are too many values. */
    is_thinned: boolean;
    /** Since the begin of the run. */
    at_s: number[];
    values: (number | string | null)[];
  })[];
};

export type CompareHistoryAnswer = ({
  point: string;
  unit: string;
  /** How far the two are apart at most; null for texts and unknown values. */
  most: number | null;
  /** Since the begin of the stretch. */
  at_s: number;
  values: (number | string | null)[];
})[];

export type HistoryWritesAnswer = {
  /** Since the begin of the run. */
  at_s: number;
  /** Who it was: an address, the owner of a certificate, a viewer, a client of a gateway, script. */
  source: string;
  /** The controller, or the line; empty for what is about neither. */
  machine: string;
  /** What was written or commanded, in words. */
  what: string;
  /** done, misuse, refusal, failure, internal; sent or empty where there is no answer. */
  outcome: string;
}[];

export type CampaignsAnswer = ({
  /** Path of its file from the folder of the description. */
  campaign: string;
  name: string;
  /** Path of the folder of its results, for GET /api/campaigns/RESULTS/report.html. */
  results: string;
  /** Why its file cannot be read, or why it did not run. */
  error: string | null;
  /** Whether this studio runs it at present. */
  is_running: boolean;
  /** Runs whose results are there. */
  done: number;
  /** Those of them that failed. */
  failed: number;
  /** How many runs it has, where its file says so. */
  total: number | null;
  /** When its results changed last: wall clock, ISO 8601. */
  changed: string | null;
  /** Of the last one that ended; its report is among the files. */
  result: {
    runs: number;
    failed: number;
    pass_rate: number | null;
    /** Of the pass rate, 95 %. */
    interval: number[];
    properties: ({
      name: string;
      /** Runs in which it did not hold. */
      failed: number;
      /** The least one: how far from violated, -1 to 1; negative where it was violated. */
      robustness: number | null;
    })[];
    causes: ({
      /** What failed. */
      what: string;
      /** The simplest case that fails so, in words. */
      where: string | null;
      runs: number;
      /** The simplest run that fails in this way, among the files of the results. */
      session: string | null;
      /** Of that run. */
      timeline: string | null;
    })[];
  } | null;
})[];

export type RunCampaignAnswer = null;

export type EndCampaignAnswer = null;

export type SettingsAnswer = {
  machine: string;
  text: string;
};

export type ShadowAnswer = null;

export type ShadowStateAnswer = {
  machine: string;
  axes: ({
    axis: number;
    name: string;
    unit: string;
    first: {
      /** Since when, from the beginning of the shadow, as decimal text [ns] */
      at_ns: string;
      /** An axis or a register. */
      what: string;
      device: number;
      twin: number;
    } | null;
    samples: ((number | null)[])[];
  })[];
  /** Those that differ now. */
  registers: {
    /** Since when, from the beginning of the shadow, as decimal text [ns] */
    at_ns: string;
    /** An axis or a register. */
    what: string;
    device: number;
    twin: number;
  }[];
  /** Registers that are compared at rest. */
  compared: number;
  /** The first difference of all. */
  first: {
    /** Since when, from the beginning of the shadow, as decimal text [ns] */
    at_ns: string;
    /** An axis or a register. */
    what: string;
    device: number;
    twin: number;
  } | null;
  /** Commands that the twin refused. */
  problems: string[];
} | null;

/** The whole state, after hello and resync. */
export type HelloMessage = {
  /** Counts the messages to this viewer from hello on, which has 0. */
  seq: number;
  hello: {
    version: 1;
    /** Version of steptwin. */
    program: string;
    /** Number of this viewer. */
    viewer: number;
    name: string;
    role: "viewer" | "operator" | "engineer";
    /** Names of requests that can be done here by this role. */
    may: string[];
    /** Names of requests for which this viewer would have to give a token. */
    with_token: string[];
    control: {
      viewer: number;
      name: string;
    } | null;
    /** How many there are. */
    viewers: number;
    leases: {
      lease: number;
      viewer: number;
      machine: string;
      axis: number;
      /** [units of the data sheet/s] */
      velocity: number;
    }[];
    /** Events with greater numbers are news. */
    number: number;
    /** Virtual time, as decimal text [ns] */
    time_ns: string;
    pace: {
      running: boolean;
      /** Virtual seconds in a second; the one at which time will go on where it stands. */
      speed: number | "max";
    };
    /** Whether all machines are twins; a device gives samples, not plans. */
    virtual: boolean;
    description: Description;
    /** By machine, as the answer to state; empty for a device. */
    state: Record<string, State>;
    /** As the answer to faults. */
    faults: Record<string, unknown>[];
    /** Present plans of all axes. */
    plans: SubjectEvent[];
  };
};

/** What has happened, of what is followed; each event once. */
export type EventsMessage = {
  /** Counts the messages to this viewer from hello on, which has 0. */
  seq: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  /** Events before these that were dropped. */
  missed: number;
  events: SubjectEvent[];
};

/** By the number of a watch as text: [index, value] of the points that have changed; null for unknown. */
export type ValuesMessage = {
  /** Counts the messages to this viewer from hello on, which has 0. */
  seq: number;
  /** Virtual time, as decimal text [ns] */
  time_ns: string;
  values: Record<string, ([number, number | null])[]>;
};

/** The present moment: once a second, and whenever time stands or goes on. */
export type ClockMessage = {
  /** Counts the messages to this viewer from hello on, which has 0. */
  seq: number;
  clock: {
    /** Virtual time, as decimal text [ns] */
    time_ns: string;
    running: boolean;
    /** Virtual seconds in a second; the one at which time will go on where it stands. */
    speed: number | "max";
  };
};

/** The moment of the past that this viewer looks at from now on; null for the present. Events go on as they happen. */
export type PastMessage = {
  /** Counts the messages to this viewer from hello on, which has 0. */
  seq: number;
  past: {
    /** Virtual time, as decimal text [ns] */
    time_ns: string;
    /** The oldest moment that is kept. [ns] */
    from_ns: string;
    /** Names of requests that can be done while the past is looked at. */
    may: string[];
    /** By machine, as the answer to state; empty for a device. */
    state: Record<string, State>;
    /** As the answer to faults. */
    faults: Record<string, unknown>[];
    /** Present plans of all axes. */
    plans: SubjectEvent[];
  } | null;
};

/** Who holds control from now on. */
export type ControlMessage = {
  /** Counts the messages to this viewer from hello on, which has 0. */
  seq: number;
  control: {
    viewer: number;
    name: string;
  } | null;
};

/** How many viewers there are now. */
export type ViewersMessage = {
  /** Counts the messages to this viewer from hello on, which has 0. */
  seq: number;
  viewers: number;
};

/** The jogs that are held now. */
export type LeasesMessage = {
  /** Counts the messages to this viewer from hello on, which has 0. */
  seq: number;
  leases: {
    lease: number;
    viewer: number;
    machine: string;
    axis: number;
    /** [units of the data sheet/s] */
    velocity: number;
  }[];
};

/** The connection to the device is lost, and why; null when it is there again. */
export type LostMessage = {
  /** Counts the messages to this viewer from hello on, which has 0. */
  seq: number;
  lost: string | null;
};

/** What is sent without being asked for. */
export type Pushed = HelloMessage | EventsMessage | ValuesMessage | ClockMessage | PastMessage | ControlMessage | ViewersMessage | LeasesMessage | LostMessage;

/** Requests and the types of their answers, by name. */
export interface Requests {
  describe: { request: DescribeRequest; answer: unknown };
  read: { request: ReadRequest; answer: unknown };
  pins: { request: PinsRequest; answer: unknown };
  state: { request: StateRequest; answer: unknown };
  encoders: { request: EncodersRequest; answer: unknown };
  faults: { request: FaultsRequest; answer: unknown };
  fault_kinds: { request: FaultKindsRequest; answer: unknown };
  time: { request: TimeRequest; answer: unknown };
  end_points: { request: EndPointsRequest; answer: unknown };
  follow: { request: FollowRequest; answer: unknown };
  unfollow: { request: UnfollowRequest; answer: unknown };
  set: { request: SetRequest; answer: unknown };
  press: { request: PressRequest; answer: unknown };
  release: { request: ReleaseRequest; answer: unknown };
  write: { request: WriteRequest; answer: unknown };
  send: { request: SendRequest; answer: unknown };
  request: { request: RequestRequest; answer: unknown };
  power_cycle: { request: PowerCycleRequest; answer: unknown };
  turn: { request: TurnRequest; answer: unknown };
  couple: { request: CoupleRequest; answer: unknown };
  fault: { request: FaultRequest; answer: unknown };
  clear_fault: { request: ClearFaultRequest; answer: unknown };
  expect: { request: ExpectRequest; answer: unknown };
  note: { request: NoteRequest; answer: unknown };
  see: { request: SeeRequest; answer: unknown };
  enable: { request: EnableRequest; answer: unknown };
  move: { request: MoveRequest; answer: unknown };
  home: { request: HomeRequest; answer: unknown };
  jog: { request: JogRequest; answer: JogAnswer };
  stop: { request: StopRequest; answer: unknown };
  stop_all: { request: StopAllRequest; answer: unknown };
  program: { request: ProgramRequest; answer: unknown };
  download: { request: DownloadRequest; answer: unknown };
  pause: { request: PauseRequest; answer: unknown };
  resume: { request: ResumeRequest; answer: unknown };
  step: { request: StepRequest; answer: unknown };
  snapshot: { request: SnapshotRequest; answer: unknown };
  snapshots: { request: SnapshotsRequest; answer: unknown };
  restore: { request: RestoreRequest; answer: unknown };
  drop_snapshot: { request: DropSnapshotRequest; answer: unknown };
  save: { request: SaveRequest; answer: unknown };
  debug: { request: DebugRequest; answer: unknown };
  breakpoint: { request: BreakpointRequest; answer: unknown };
  clear_breakpoint: { request: ClearBreakpointRequest; answer: unknown };
  breakpoints: { request: BreakpointsRequest; answer: unknown };
  stop_on: { request: StopOnRequest; answer: unknown };
  step_program: { request: StepProgramRequest; answer: unknown };
  run: { request: RunRequest; answer: unknown };
  look_at: { request: LookAtRequest; answer: unknown };
  branch: { request: BranchRequest; answer: unknown };
  stack: { request: StackRequest; answer: unknown };
  values: { request: ValuesRequest; answer: unknown };
  evaluate: { request: EvaluateRequest; answer: unknown };
  set_value: { request: SetValueRequest; answer: unknown };
  program_source: { request: ProgramSourceRequest; answer: unknown };
  why: { request: WhyRequest; answer: unknown };
  hello: { request: HelloRequest; answer: HelloAnswer };
  resync: { request: ResyncRequest; answer: ResyncAnswer };
  watch: { request: WatchRequest; answer: WatchAnswer };
  unwatch: { request: UnwatchRequest; answer: UnwatchAnswer };
  take_control: { request: TakeControlRequest; answer: TakeControlAnswer };
  release_control: { request: ReleaseControlRequest; answer: ReleaseControlAnswer };
  renew: { request: RenewRequest; answer: RenewAnswer };
  let_go: { request: LetGoRequest; answer: LetGoAnswer };
  look: { request: LookRequest; answer: LookAnswer };
  past_events: { request: PastEventsRequest; answer: PastEventsAnswer };
  go_back: { request: GoBackRequest; answer: GoBackAnswer };
  programs: { request: ProgramsRequest; answer: ProgramsAnswer };
  program_text: { request: ProgramTextRequest; answer: ProgramTextAnswer };
  program_memory: { request: ProgramMemoryRequest; answer: ProgramMemoryAnswer };
  ports: { request: PortsRequest; answer: PortsAnswer };
  connect: { request: ConnectRequest; answer: ConnectAnswer };
  disconnect: { request: DisconnectRequest; answer: DisconnectAnswer };
  traffic: { request: TrafficRequest; answer: TrafficAnswer };
  audit: { request: AuditRequest; answer: AuditAnswer };
  calculator: { request: CalculatorRequest; answer: CalculatorAnswer };
  calculate: { request: CalculateRequest; answer: CalculateAnswer };
  gear: { request: GearRequest; answer: GearAnswer };
  configuration: { request: ConfigurationRequest; answer: ConfigurationAnswer };
  edit_configuration: { request: EditConfigurationRequest; answer: EditConfigurationAnswer };
  scan: { request: ScanRequest; answer: ScanAnswer };
  verify: { request: VerifyRequest; answer: VerifyAnswer };
  work: { request: WorkRequest; answer: WorkAnswer };
  cancel_work: { request: CancelWorkRequest; answer: CancelWorkAnswer };
  recordings: { request: RecordingsRequest; answer: RecordingsAnswer };
  save_recording: { request: SaveRecordingRequest; answer: SaveRecordingAnswer };
  view_recording: { request: ViewRecordingRequest; answer: ViewRecordingAnswer };
  branches: { request: BranchesRequest; answer: BranchesAnswer };
  start_branch: { request: StartBranchRequest; answer: StartBranchAnswer };
  end_branch: { request: EndBranchRequest; answer: EndBranchAnswer };
  drawing: { request: DrawingRequest; answer: DrawingAnswer };
  save_drawing: { request: SaveDrawingRequest; answer: SaveDrawingAnswer };
  gateways: { request: GatewaysRequest; answer: GatewaysAnswer };
  history: { request: HistoryRequest; answer: HistoryAnswer };
  history_values: { request: HistoryValuesRequest; answer: HistoryValuesAnswer };
  compare_history: { request: CompareHistoryRequest; answer: CompareHistoryAnswer };
  history_writes: { request: HistoryWritesRequest; answer: HistoryWritesAnswer };
  campaigns: { request: CampaignsRequest; answer: CampaignsAnswer };
  run_campaign: { request: RunCampaignRequest; answer: RunCampaignAnswer };
  end_campaign: { request: EndCampaignRequest; answer: EndCampaignAnswer };
  settings: { request: SettingsRequest; answer: SettingsAnswer };
  shadow: { request: ShadowRequest; answer: ShadowAnswer };
  shadow_state: { request: ShadowStateRequest; answer: ShadowStateAnswer };
}
