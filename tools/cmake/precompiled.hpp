// Precompiled header with the most common includes of the modules (Options.cmake). Each source still includes
// what it uses, since most builds have no precompiled headers.
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
