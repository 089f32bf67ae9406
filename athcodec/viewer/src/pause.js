// A worker gets its messages only between two tasks: long work pauses, so that pictures can be asked for meanwhile.

const channel = new MessageChannel(), waiting = [];
channel.port1.onmessage = () => waiting.shift()();

export const pause = () => new Promise((done) => { waiting.push(done); channel.port2.postMessage(0); });
