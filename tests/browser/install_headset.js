// A headset that lives in the page; tests move it by `headset`. `fakeStation.headset`: what it has otherwise.
globalThis.headset = new IWER.XRDevice({ ...IWER.metaQuest3, ...globalThis.fakeStation?.headset });  // the browser's own interface has no device
globalThis.headset.installRuntime({ forceInstall: true });
