// A headset that lives in the page; tests move it by `headset`.
globalThis.headset = new IWER.XRDevice(IWER.metaQuest3);  // the browser's own interface has no device
globalThis.headset.installRuntime({ forceInstall: true });
