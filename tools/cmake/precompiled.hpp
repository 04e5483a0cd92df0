// What most sources of the rooms include, parsed once a build (Options.cmake). Each source names what it uses
// all the same: builds without precompiled headers are the common ones.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <thread>
#include <tuple>
#include <unordered_map>
#include <variant>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/codec.hpp"
#include "protocols/scenario.hpp"
#include "protocols/scene.hpp"
