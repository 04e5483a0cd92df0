// The mapper's thread: newest view first, drops counted, a bad view affects nothing else.
#include "server/runtime/site_mapper.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>

#include "tests/server/tick/synthetic.hpp"

namespace parhelion::runtime {
namespace {

SiteView view(int number) {
  PlacedDepth view;
  view.depth.stamp = SensorTime::from_utime(test::kStartUs + number);
  return view;
}

std::vector<SiteMapper::Ready> take(SiteMapper& mapper, std::size_t count) {
  std::vector<SiteMapper::Ready> taken;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (taken.size() < count && std::chrono::steady_clock::now() < end) {
    if (auto ready = mapper.take()) {
      taken.push_back(std::move(*ready));
    } else {
      std::this_thread::yield();
    }
  }
  return taken;
}

TEST(SiteMapper, DrawsTheNewestViewFirstAndCountsDroppedOnes) {
  const tick::Configuration configuration = test::configuration({});
  std::promise<void> begun, open;
  std::shared_future<void> gate = open.get_future().share();
  bool first = true;
  std::vector<std::int64_t> order;
  SiteMapper mapper(
      [&](const SiteView& seen) -> Result<std::optional<SemanticModel>> {
        if (std::exchange(first, false)) {
          begun.set_value();
          gate.wait();
        }
        order.push_back(stamp_of(seen).utime() - test::kStartUs);
        return std::optional(test::room());
      },
      configuration, 5);
  mapper.submit(view(1));
  begun.get_future().wait();
  for (int i = 2; i <= 7; ++i) mapper.submit(view(i));
  open.set_value();
  const auto models = take(mapper, 5);
  ASSERT_EQ(models.size(), 5U);
  EXPECT_EQ(order, (std::vector<std::int64_t>{1, 7, 6, 5, 4}));
  EXPECT_EQ(mapper.counts().dropped, 2U);
  for (std::size_t i = 0; i < models.size(); ++i) {
    EXPECT_EQ(models[i].message.version, i + 1);
    EXPECT_EQ(models[i].prepared.version, i + 1);
    EXPECT_EQ(models[i].prepared.model->entities.size(), test::room().entities.size());
  }
}

TEST(SiteMapper, AnUnusableViewIsCountedAndTheNextOneIsUsed) {
  const tick::Configuration configuration = test::configuration({});
  std::atomic<int> calls = 0;
  SiteMapper mapper(
      [&](const SiteView&) -> Result<std::optional<SemanticModel>> {
        const int call = ++calls;
        calls.notify_all();
        switch (call) {
          case 1:
            return Error{"no overlap"};
          case 2:
            throw std::runtime_error("broken");
          case 3:
            return std::optional<SemanticModel>();
          case 4: {
            SemanticModel foreign = test::room();
            foreign.map_id = "another";
            return std::optional(foreign);
          }
          default:
            return std::optional(test::room());
        }
      },
      configuration, 5);
  for (int i = 1; i <= 5; ++i) {
    mapper.submit(view(i));
    calls.wait(i - 1);
  }
  const auto models = take(mapper, 1);
  ASSERT_EQ(models.size(), 1U);
  EXPECT_EQ(models[0].message.version, 1U);
  EXPECT_EQ(mapper.counts().refused, 3U);
  EXPECT_NE(mapper.counts().last_refusal.find("another"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::runtime
