#include "server/tick/frame_path.hpp"

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"

namespace parhelion::tick {
namespace {

/// If nothing could be rendered no image is published, and the report gives the reason.
void publish_agent_frame(const Configuration& configuration, const FrameAnswer& done, Outputs& outputs,
                         Tally& tally) {
  if (done.answer.image.bytes.empty()) return;
  encode(done.answer.image, outputs.add(configuration.channels.bus(agent_camera_channel(done.agent))));
  ++tally.agent_frames_out;
}

/// Rendered images already show the bodies: MR_CAMERA is CAMERA and MR_DEPTH is DEPTH, as MR_SCAN is SCAN. If
/// nothing could be rendered no image is published, and the report gives the reason.
void publish_simulated_frame(const Configuration& configuration, const FrameAnswer& done, Outputs& outputs,
                             Tally& tally) {
  const render::RenderAnswer& answer = done.answer;
  const auto add = [&](const char* name) -> std::vector<std::uint8_t>& {
    return outputs.add(configuration.channels.robots_bus(name, done.robot, done.camera));
  };
  const bool seen = !answer.image.bytes.empty();
  // Depth first, so that it is available to receivers when the image arrives.
  for (const char* name : {channel::kDepth, channel::kMrDepth})
    if (answer.depth) encode(*answer.depth, add(name));
  for (const char* name : {channel::kCamera, channel::kMrCamera})
    if (seen) encode(answer.image, add(name));
  if (seen || answer.depth) ++tally.frames_out;
}

}  // namespace

void publish_frame(const Configuration& configuration, const FrameAnswer& done, Outputs& outputs,
                   Tally& tally) {
  if (!done.agent.empty()) return publish_agent_frame(configuration, done, outputs, tally);
  if (done.simulated) return publish_simulated_frame(configuration, done, outputs, tally);
  const auto add = [&](const char* name) -> std::vector<std::uint8_t>& {
    return outputs.add(configuration.channels.robots_bus(name, done.robot, done.camera));
  };
  if (done.answer.image.width > 0) encode(done.answer.image, add(channel::kMrCamera));
  if (done.answer.depth) encode(*done.answer.depth, add(channel::kMrDepth));
  ++tally.frames_out;
  if (done.answer.drawn || done.answer.depth_drawn) ++tally.frames_composited;
}

}  // namespace parhelion::tick
