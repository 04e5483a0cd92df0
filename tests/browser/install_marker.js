// Image tracking, which the emulated headset lacks: the marker is seen in each frame at `fakeMarker`, in the headset's
// space (a rotation about the vertical; its normal is z before it).
(() => {
  const device = IWER.XRDevice.prototype, install = device.installRuntime;
  device.installRuntime = function (...all) {
    install.apply(this, all);
    XRSession.prototype.getTrackedImageScores = async () => ["trackable"];
    XRFrame.prototype.getImageTrackingResults = function () {
      return globalThis.fakeMarker ? [{ index: 0, trackingState: "tracked", measuredWidthInMeters: 0.18, imageSpace: "marker" }] : [];
    };
    const { getPose } = XRFrame.prototype;
    XRFrame.prototype.getPose = function (space, base) {
      if (space !== "marker") return getPose.call(this, space, base);
      const { at: [x, y, z], turn } = globalThis.fakeMarker;
      return { transform: { position: { x, y, z }, orientation: { x: 0, y: Math.sin(turn / 2), z: 0, w: Math.cos(turn / 2) } } };
    };
  };
})();
