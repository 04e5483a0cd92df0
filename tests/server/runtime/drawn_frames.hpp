// Frames that are drawn at once, as in a replay on one thread.
#pragma once

#include <gtest/gtest.h>

#include <utility>

#include "server/runtime/render_thread.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::test {

/// Draws the frame and leaves in `outputs` what the tick publishes of it, alone.
inline void draw_frame(runtime::RenderThread& renderer, tick::Outputs::Frame frame,
                       const tick::Configuration& configuration, tick::Tally& tally, tick::Outputs& outputs) {
  renderer.submit(std::move(frame));
  const auto done = renderer.take(true);
  ASSERT_TRUE(done);
  EXPECT_EQ(done->answer.reason, "");
  outputs.clear();
  tick::publish_frame(configuration, *done, outputs, tally);
}

}  // namespace parhelion::test
