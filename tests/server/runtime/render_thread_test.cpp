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

TEST(RenderThread, KeepsTheNewestImageOfEachCamera) {
  const SemanticModel room = test::room();
  RenderThread renderer(room, false, 0);
  const auto submit = [&](std::size_t camera, std::uint64_t sequence) {
    tick::Outputs::Frame frame;
    frame.camera = camera;
    frame.sequence = sequence;
    frame.reason = "passed on as it came";
    return renderer.submit_newest(std::move(frame));
  };
  // Whether or not the first is in progress by now, another camera's image never replaces it.
  EXPECT_FALSE(submit(0, 1));
  EXPECT_FALSE(submit(1, 2));
  EXPECT_FALSE(submit(2, 3));
  renderer.wait();
  std::vector<std::size_t> cameras;
  while (const auto answer = renderer.take(false)) cameras.push_back(answer->camera);
  EXPECT_EQ(cameras, (std::vector<std::size_t>{0, 1, 2}));
}

}  // namespace
}  // namespace parhelion::runtime
