#include "protocols/available_memory.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

namespace parhelion {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// The number in a control group's file; no limit where it is "max" or the file is missing.
std::uint64_t group_number(const char* path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
}

/// Of the group's files in memory, which it gives back when it needs the room.
std::uint64_t group_cache() {
  std::ifstream file("/sys/fs/cgroup/memory.stat");
  std::uint64_t cache = 0, number = 0;
  for (std::string name; file >> name >> number;) {
    if (name == "active_file" || name == "inactive_file") cache += number;
  }
  return cache;
}

/// What the limit on this process's address space (ulimit -v) leaves.
std::uint64_t addresses_left() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kUnlimited;
  std::ifstream pages("/proc/self/statm");
  std::uint64_t used = 0;
  if (!(pages >> used)) return kUnlimited;
  used *= static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  return limit.rlim_cur - std::min<std::uint64_t>(limit.rlim_cur, used);
}

}  // namespace

std::uint64_t available_memory() {
  std::uint64_t available = kUnlimited;
  std::ifstream memory("/proc/meminfo");
  for (std::string line; std::getline(memory, line);) {
    unsigned long long kibibytes = 0;
    if (std::sscanf(line.c_str(), "MemAvailable: %llu kB", &kibibytes) == 1) available = kibibytes * 1024;
  }
  const std::uint64_t limit = group_number("/sys/fs/cgroup/memory.max");
  const std::uint64_t used = group_number("/sys/fs/cgroup/memory.current");
  if (limit != kUnlimited && used != kUnlimited) {
    const std::uint64_t kept = used - std::min(used, group_cache());
    available = std::min(available, limit - std::min(limit, kept));
  }
  return std::min(available, addresses_left());
}

}  // namespace parhelion
