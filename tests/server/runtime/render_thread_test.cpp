#include "server/runtime/render_thread.hpp"

#include <gtest/gtest.h>

#include <future>

#include "tests/server/tick/synthetic.hpp"

namespace parhelion::runtime {
namespace {

TEST(RenderThread, SignalsThatAPictureIsReady) {
  const SemanticModel room = test::room();
  std::promise<void> finished;
  RenderThread renderer(room, false, 0, [&finished] { finished.set_value(); });
  tick::Outputs::Frame frame;
  frame.sequence = 7;
  frame.reason = "passed on as it came";
  renderer.submit(std::move(frame));
  ASSERT_EQ(finished.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  const auto answer = renderer.take(false);
  ASSERT_TRUE(answer) << "it was reported before it was there";
  EXPECT_EQ(answer->sequence, 7U);
}

}  // namespace
}  // namespace parhelion::runtime
