// What CMake makes of `dist`.
#pragma once

#include <span>

#include "server/station/web/page_files.hpp"

namespace parhelion::station {
std::span<const PageFile> page_table();
}
