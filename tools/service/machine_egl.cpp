// EGL is loaded at run time, so that `doctor` starts and reports a missing EGL.
#include <dlfcn.h>

#include <cstdint>

#include "tools/service/machine_checks.hpp"

namespace parhelion::tools {
namespace {

using Verdict = MachineCheck::Verdict;
using Handle = void*;

// Values from the Khronos registry (EGL 1.5, EGL_MESA_platform_surfaceless, OpenGL ES 3).
constexpr unsigned kPlatformSurfaceless = 0x31DD;
constexpr std::int32_t kSurfaceType = 0x3033, kPbufferBit = 1, kRenderableType = 0x3040, kEs3Bit = 0x40,
                       kNone = 0x3038;
constexpr std::int32_t kContextVersion = 0x3098;
constexpr unsigned kEsApi = 0x30A0;
constexpr unsigned kGlRenderer = 0x1F01;

constexpr const char* kRemedy = "apt-get install libegl1 libgles2 libgl1-mesa-dri";

struct Library {
  Handle handle = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
  ~Library() {
    if (handle != nullptr) dlclose(handle);
  }
  template <class Function>
  Function find(const char* name) const {
    return reinterpret_cast<Function>(dlsym(handle, name));
  }
};

MachineCheck failed(const char* finding) { return {"EGL without display", Verdict::fail, finding, kRemedy}; }

}  // namespace

MachineCheck check_egl() {
  const Library egl;
  if (egl.handle == nullptr) return failed("libEGL.so.1 is missing");
  const auto get_proc = egl.find<void (*(*)(const char*))()>("eglGetProcAddress");
  const auto initialize = egl.find<unsigned (*)(Handle, std::int32_t*, std::int32_t*)>("eglInitialize");
  const auto terminate = egl.find<unsigned (*)(Handle)>("eglTerminate");
  const auto bind_api = egl.find<unsigned (*)(unsigned)>("eglBindAPI");
  const auto choose =
      egl.find<unsigned (*)(Handle, const std::int32_t*, Handle*, std::int32_t, std::int32_t*)>(
          "eglChooseConfig");
  const auto create = egl.find<Handle (*)(Handle, Handle, Handle, const std::int32_t*)>("eglCreateContext");
  const auto make_current = egl.find<unsigned (*)(Handle, Handle, Handle, Handle)>("eglMakeCurrent");
  if (!get_proc || !initialize || !terminate || !bind_api || !choose || !create || !make_current) {
    return failed("libEGL.so.1 lacks functions of EGL 1.4");
  }
  const auto get_display = reinterpret_cast<Handle (*)(unsigned, Handle, const std::int32_t*)>(
      get_proc("eglGetPlatformDisplayEXT"));
  const Handle display =
      get_display == nullptr ? nullptr : get_display(kPlatformSurfaceless, nullptr, nullptr);
  std::int32_t major = 0, minor = 0;
  if (display == nullptr || initialize(display, &major, &minor) == 0) return failed("no surfaceless display");

  MachineCheck check = failed("no OpenGL ES 3 context");
  const std::int32_t wanted[] = {kSurfaceType, kPbufferBit, kRenderableType, kEs3Bit, kNone};
  const std::int32_t version[] = {kContextVersion, 3, kNone};
  Handle config = nullptr, context = nullptr;
  std::int32_t configs = 0;
  if (bind_api(kEsApi) != 0 && choose(display, wanted, &config, 1, &configs) != 0 && configs == 1) {
    context = create(display, config, nullptr, version);
  }
  if (context != nullptr && make_current(display, nullptr, nullptr, context) != 0) {
    const auto get_string = reinterpret_cast<const unsigned char* (*)(unsigned)>(get_proc("glGetString"));
    const auto* renderer = get_string == nullptr ? nullptr : get_string(kGlRenderer);
    if (renderer != nullptr) check = {check.name, Verdict::ok, reinterpret_cast<const char*>(renderer), ""};
    make_current(display, nullptr, nullptr, nullptr);
  }
  terminate(display);
  return check;
}

}  // namespace parhelion::tools
