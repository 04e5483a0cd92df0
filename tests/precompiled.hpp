// What most tests include, as tools/cmake/precompiled.hpp is for the rooms.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "tools/cmake/precompiled.hpp"
