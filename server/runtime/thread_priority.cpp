#include "server/runtime/thread_priority.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <thread>

namespace parhelion::runtime {
namespace {

constexpr int kRealTimePriority = 10;  // above normal threads, below the kernel's

bool set_policy(int policy, int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return sched_setscheduler(0, policy, &parameters) == 0;  // 0: the calling thread
}

}  // namespace

void lower_priority(int nice) {
  // Lowering a priority is always permitted; an inherited one may be real-time.
  (void)set_policy(SCHED_BATCH, 0);
  (void)setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), nice);
}

Status with_lower_priority(int nice, const std::function<Status()>& task) {
  Status done;
  std::thread([&] {
    lower_priority(nice);
    done = task();
  }).join();
  return done;
}

Result<RealTime> parse_real_time(const std::string& word) {
  if (word == "off") return RealTime::off;
  if (word == "on") return RealTime::on;
  if (word == "auto") return RealTime::automatic;
  return Error{"real-time '" + word + "': expected off, on or auto"};
}

RealTimeScope::RealTimeScope(RealTime wanted) {
  if (wanted == RealTime::off) {
    note_ = "normal priority: real-time is off";
    return;
  }
  if (wanted == RealTime::automatic && std::thread::hardware_concurrency() < 2) {
    note_ = "normal priority: real-time needs a second core";
    return;
  }
  sched_param before{};
  policy_before_ = sched_getscheduler(0);
  (void)sched_getparam(0, &before);
  priority_before_ = before.sched_priority;
  holds_ = set_policy(SCHED_FIFO, kRealTimePriority);
  const int refusal = errno;
  note_ = holds_ ? std::string("real-time")
                 : std::string("normal priority: real-time: ") + std::strerror(refusal) +
                       "; to allow it: " + remedy();
}

const char* RealTimeScope::remedy() {
  return "LimitRTPRIO=10 in a systemd unit, 'ulimit -r 10' in a shell, or 'setcap cap_sys_nice+ep' on the "
         "program";
}

RealTimeScope::~RealTimeScope() {
  if (holds_) (void)set_policy(policy_before_, priority_before_);
}

}  // namespace parhelion::runtime
