// The page's side of the protocol (client/hullctl/view/protocol.h), over a WebSocket to the bridge
// or from a recording.

const utf8 = new TextDecoder();

// Returns {head, xyz: Float64Array, rest: Uint32Array} for a binary frame.
export function decodeFrame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(utf8.decode(new Uint8Array(buffer, 4, length)));
  const start = Math.ceil((4 + length) / 8) * 8;
  const vertices = head.vertices || 0;
  const xyz = new Float64Array(buffer, start, 3 * vertices);
  return {head, xyz, rest: new Uint32Array(buffer, start + 24 * vertices)};
}

// Calls handlers.TYPE(message) for each message and handlers.frame({head, xyz, rest}).
class BridgeConnection {
  constructor(handlers) {
    this.live = true;
    this.socket = new WebSocket(`ws://${location.host}/page`);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onmessage = ({data}) => {
      if (data instanceof ArrayBuffer) {
        handlers.frame(decodeFrame(data));
        return;
      }
      const message = JSON.parse(data);
      handlers[message.type]?.(message);
    };
    this.socket.onclose = () => handlers.lost();
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
}

// Answers from a recording, at the waypoint or time last requested; unrecorded queries get no
// answer.
class Recording {
  constructor(handlers, recording) {
    this.live = false;
    this.handlers = handlers;
    this.recording = recording;
    this.state = recording.states[0];
    queueMicrotask(() => {
      handlers.hello({...recording.hello, scenes: []});
      handlers.scene(recording.scene);
      for (const text of recording.frames) {
        const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
        handlers.frame(decodeFrame(bytes.buffer));
      }
      handlers.collisions(this.state.collisions);
    });
  }

  send({type, scene, waypoint, time, pair, update}) {
    const {states, motions} = this.recording;
    if (type === 'joints') {
      this.state = states[waypoint];
      this.handlers.poses({scene, poses: this.state.poses});
      this.handlers.collisions(this.state.collisions);
    }
    if (type !== 'query' || !pair) return;
    const state = time === null ? this.state : states.find((each) => each.time === time);
    if (!state) return;
    if (state !== this.state) {
      this.state = state;
      this.handlers.collisions(state.collisions);
    }
    const [a, b] = pair;
    const ofPair = ({pair}) => pair[0] === a && pair[1] === b;
    const answer = state.answers.find(ofPair);
    if (answer) this.handlers.answer({...answer, update});
    const motion = motions.find(ofPair);
    if (motion) this.handlers.motion({...motion, update});
  }
}

export function connect(handlers) {
  const element = document.getElementById('recording');
  return element ? new Recording(handlers, JSON.parse(element.textContent)) :
                   new BridgeConnection(handlers);
}
