#include "tests/wall_clock_step.hpp"

#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <ctime>

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;  // ns
std::atomic<std::int64_t> forward = 0;           // ns

}  // namespace

// The program's own definition comes before the C library's.
extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const auto result = static_cast<int>(syscall(SYS_clock_gettime, clock, now));
  if (result != 0 || clock != CLOCK_REALTIME) return result;
  const std::int64_t set = now->tv_sec * kSecond + now->tv_nsec + forward;
  *now = {set / kSecond, set % kSecond};
  return result;
}

namespace parhelion::test {

WallClockStep::WallClockStep(Duration step) : forward_(step) { forward += step.ns; }

WallClockStep::~WallClockStep() { forward -= forward_.ns; }

}  // namespace parhelion::test
