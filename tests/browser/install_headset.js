// A headset simulated in the page; tests move it through `headset`. `fakeStation.headset`: deviations from
// the default.
globalThis.headset = new IWER.XRDevice({ ...IWER.metaQuest3, ...globalThis.fakeStation?.headset });  // the browser's own interface has no device
globalThis.headset.installRuntime({ forceInstall: true });
