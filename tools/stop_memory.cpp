#include "tools/stop_memory.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "protocols/sha256.hpp"
#include "server/runtime/thread_priority.hpp"
#include "server/station/http/private_file.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kPrefix = "emergency-stop-";

std::filesystem::path file_of(const std::filesystem::path& folder, const std::string& bus,
                              const std::string& robot) {
  const std::string key = bus + '\n' + robot;
  Sha256 hash;
  hash.add({reinterpret_cast<const std::uint8_t*>(key.data()), key.size()});
  return folder / (kPrefix + hash.hex().substr(0, 16));
}

void sync_to_disk(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  (void)fsync(descriptor);
  close(descriptor);
}

}  // namespace

StopMemory::StopMemory(const std::filesystem::path& folder, const std::string& bus, const std::string& robot)
    : path_(file_of(folder, bus, robot)),
      bus_(bus),
      robot_(robot),
      syncer_([this](const std::stop_token& stop) { sync_what_is_written(stop); }) {}

bool StopMemory::holds() const { return access(path_.c_str(), F_OK) == 0 || errno != ENOENT; }

Status StopMemory::keep(bool holds) {
  const auto failed = [&] {
    return Error{path_.string() + ": " + std::strerror(errno) + "; a restarted server " +
                 (holds ? "does not keep the robot stopped" : "stops the robot again")};
  };
  if (holds) {
    if (Status made = station::make_private_folder(path_.parent_path()); !made) return made;
    errno = 0;
    std::ofstream file(path_);
    file << "An emergency stop of the robot '" << robot_ << "' on the bus " << bus_
         << " is active. Release it at the base station, or with: parhelion inject release-emergency-stop "
            "--name "
         << robot_ << "\n";
    if (!file.flush()) return failed();
  } else if (unlink(path_.c_str()) != 0 && errno != ENOENT) {
    return failed();
  }
  const std::lock_guard lock(mutex_);
  to_sync_ = true;
  written_.notify_one();
  return {};
}

void StopMemory::sync_what_is_written(const std::stop_token& stop) {
  runtime::lower_priority(0);
  std::unique_lock lock(mutex_);
  while (written_.wait(lock, stop, [this] { return to_sync_; })) {
    to_sync_ = false;
    lock.unlock();
    sync_to_disk(path_);
    sync_to_disk(path_.parent_path());
    lock.lock();
  }
}

std::vector<std::string> active_stops(const std::filesystem::path& folder) {
  std::vector<std::string> stops;
  std::error_code absent;
  for (const auto& entry : std::filesystem::directory_iterator(folder, absent)) {
    if (!entry.path().filename().string().starts_with(kPrefix)) continue;
    std::string line;
    std::ifstream file(entry.path());
    stops.push_back(std::getline(file, line) ? line
                                             : entry.path().string() + ": an emergency stop is active");
  }
  std::sort(stops.begin(), stops.end());
  return stops;
}

}  // namespace parhelion::tools
