# What every target is compiled with. The flags of promise 4: portable baseline, no contraction, no fast maths.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

set(PARHELION_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them")
option(PARHELION_FUZZ "Build the libFuzzer targets (clang only)" OFF)

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

# A build from nothing is over a quarter shorter with precompiled headers. A cache does better for who builds often, and
# does not know one folder's precompiled headers in another.
set(precompile ON)
if(CCACHE)
  set(precompile OFF)
endif()
option(PARHELION_PRECOMPILE "Precompile what most sources include" ${precompile})

# The optimisation of what is seldom run and long to compile. Under sanitizers most of the time goes there too; what
# takes part in a tick keeps the preset's.
set(PARHELION_COLD $<$<CONFIG:Release>:-O1>)
if(PARHELION_SANITIZE)
  set(PARHELION_COLD -O0)
endif()

include(GNUInstallDirs)
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)

add_library(parhelion_flags INTERFACE)
target_include_directories(parhelion_flags INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(parhelion_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
  -Woverloaded-virtual -Werror -ffp-contract=off)
# GCC 12 sees overlaps in std::string's operator+ that are not there (GCC bug 105651).
# GCC 12's SLP vectorizer drops the rounding of double -> float -> double, so that release and debug would give
# other bytes (promise 4; tests/protocols/compiler_test.cpp).
target_compile_options(parhelion_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict -fno-tree-slp-vectorize>)
if(PARHELION_PRECOMPILE)
  # Other faces of that bug, seen where the standard headers are precompiled.
  target_compile_options(parhelion_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds -Wno-stringop-overflow
    -Wno-stringop-overread>)
  # Some libraries ask for it, and a precompiled header wants all to be alike.
  target_compile_options(parhelion_flags INTERFACE -pthread)
endif()
target_link_libraries(parhelion_flags INTERFACE Eigen3::Eigen Threads::Threads)
if(PARHELION_SANITIZE)
  target_compile_options(parhelion_flags INTERFACE -fsanitize=${PARHELION_SANITIZE} -fno-omit-frame-pointer
    -fno-sanitize-recover=all)
  # A good part of what tests take to compile; the rooms themselves are checked for undefined behaviour.
  target_compile_options(parhelion_flags INTERFACE
    $<$<BOOL:$<TARGET_PROPERTY:PARHELION_TEST>>:-fno-sanitize=undefined>)
  target_link_options(parhelion_flags INTERFACE -fsanitize=${PARHELION_SANITIZE})
  foreach(sanitizer address thread)
    if(PARHELION_SANITIZE MATCHES ${sanitizer})
      string(TOUPPER ${sanitizer} name)
      target_compile_definitions(parhelion_flags INTERFACE PARHELION_${name}_SANITIZER)
    endif()
  endforeach()
  # With sanitizers GCC 12 takes std::regex for uninitialized; the sanitizers themselves look at run time.
  target_compile_options(parhelion_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
endif()
# parhelion_precompile(name header [LINK libraries]): a header that targets compiled with the same flags take over by
# parhelion_use_precompiled(target name).
function(parhelion_precompile name header)
  cmake_parse_arguments(ARG "" "" "LINK" ${ARGN})
  if(PARHELION_PRECOMPILE)
    # A target of its own: definitions that only one room has would be expected of all.
    file(CONFIGURE OUTPUT ${name}.cpp CONTENT "")
    add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
    target_link_libraries(${name} PRIVATE parhelion_flags ${ARG_LINK})
    target_precompile_headers(${name} PRIVATE ${CMAKE_SOURCE_DIR}/${header})
  endif()
endfunction()

function(parhelion_use_precompiled target name)
  if(PARHELION_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${name})
  endif()
endfunction()

parhelion_precompile(precompiled tools/cmake/precompiled.hpp)
if(PARHELION_SANITIZE)
  parhelion_precompile(precompiled_outside_tick tools/cmake/precompiled.hpp)
  if(TARGET precompiled_outside_tick)
    target_compile_options(precompiled_outside_tick PRIVATE ${PARHELION_COLD})
  endif()
endif()

# parhelion_library(name SOURCES... [PUBLIC targets] [PRIVATE targets] [SYSTEM include dirs]
#                   [OUTSIDE_TICK: under sanitizers it is not optimised]
#                   [PRECOMPILED by parhelion_precompile, where it is not what all rooms have])
function(parhelion_library name)
  cmake_parse_arguments(ARG "OUTSIDE_TICK" "PRECOMPILED" "SOURCES;PUBLIC;PRIVATE;SYSTEM" ${ARGN})
  if(ARG_OUTSIDE_TICK AND PARHELION_SANITIZE)
    set(ARG_PRECOMPILED precompiled_outside_tick)
  elseif(NOT ARG_PRECOMPILED)
    set(ARG_PRECOMPILED precompiled)
  endif()
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC parhelion_flags ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  target_include_directories(${name} SYSTEM PRIVATE ${ARG_SYSTEM})
  if(ARG_OUTSIDE_TICK AND PARHELION_SANITIZE)
    target_compile_options(${name} PRIVATE ${PARHELION_COLD})
  endif()
  parhelion_use_precompiled(${name} ${ARG_PRECOMPILED})
endfunction()

# parhelion_cold(SOURCES...): seldom run, long to compile. GCC takes the level of optimisation from the precompiled
# header where there is one.
function(parhelion_cold)
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS ${PARHELION_COLD} SKIP_PRECOMPILE_HEADERS ON)
endfunction()
