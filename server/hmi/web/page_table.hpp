// What CMake makes of `dist`.
#pragma once

#include <span>

#include "server/hmi/web/page_files.hpp"

namespace parhelion {
std::span<const PageFile> page_table();
}
