#include "server/runtime/thread_priority.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

namespace parhelion::runtime {
namespace {

/// Of the calling thread.
int nice_now() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

TEST(LowerPriority, IsInheritedByNewThreads) {
  int policy = -1, nice = -1;
  const Status done = with_lower_priority(7, [&]() -> Status {
    std::thread([&] {
      policy = sched_getscheduler(0);
      nice = nice_now();
    }).join();
    return Error{"as the task says"};
  });
  EXPECT_EQ(policy, SCHED_BATCH);
  EXPECT_EQ(nice, 7);
  EXPECT_EQ(done.error().message, "as the task says");
  EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER) << "the caller gives nothing up";
}

TEST(RealTimeScope, AppliesWhereAllowedUntilTheScopeEnds) {
  std::thread([] {
    {
      const RealTimeScope scope(RealTime::on);
      if (!scope.holds()) GTEST_SKIP() << scope.note();
      EXPECT_EQ(scope.note(), "real-time");
      EXPECT_EQ(sched_getscheduler(0), SCHED_FIFO);
      int started = -1, lowered_policy = -1;
      std::thread([&] { started = sched_getscheduler(0); }).join();
      EXPECT_EQ(started, SCHED_FIFO) << "what scans wait for is started within";
      std::thread([&] {
        lower_priority(0);
        lowered_policy = sched_getscheduler(0);
      }).join();
      EXPECT_EQ(lowered_policy, SCHED_BATCH);
    }
    EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER);
  }).join();
}

TEST(RealTimeScope, ReportsTheRemedyWhereItIsRefused) {
  // In a separate process without permission: no capability, and no limit that allows it.
  const pid_t child = fork();
  if (child == 0) {
    const rlimit none{0, 0};
    const bool dropped = setrlimit(RLIMIT_RTPRIO, &none) == 0 && (getuid() != 0 || setuid(65534) == 0);
    const RealTimeScope scope(RealTime::on);
    const bool explained = !scope.holds() && scope.note().find("LimitRTPRIO") != std::string::npos;
    _exit(!dropped ? 2 : (explained && sched_getscheduler(0) == SCHED_OTHER ? 0 : 1));
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(RealTimeScope, IsNotUsedWhenDisabled) {
  const RealTimeScope scope(RealTime::off);
  EXPECT_FALSE(scope.holds());
  EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER);
}

TEST(RealTime, IsParsedFromItsName) {
  EXPECT_EQ(*parse_real_time("auto"), RealTime::automatic);
  EXPECT_EQ(*parse_real_time("on"), RealTime::on);
  EXPECT_EQ(*parse_real_time("off"), RealTime::off);
  EXPECT_NE(parse_real_time("yes").error().message.find("off, on or auto"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::runtime
