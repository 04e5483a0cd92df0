#include "render/egl_context.hpp"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>
#include <vector>

namespace parhelion::render {
namespace {

constexpr const char* kWhatToDo =
    "; install libegl1 and libgl1-mesa-dri (apt-get install libegl1 libgl1-mesa-dri)";

struct EglFunctions {
  decltype(&eglGetProcAddress) get_proc_address;
  decltype(&eglQueryString) query_string;
  decltype(&eglGetError) get_error;
  decltype(&eglInitialize) initialize;
  decltype(&eglTerminate) terminate;
  decltype(&eglBindAPI) bind_api;
  decltype(&eglChooseConfig) choose_config;
  decltype(&eglCreateContext) create_context;
  decltype(&eglDestroyContext) destroy_context;
  decltype(&eglMakeCurrent) make_current;
};

bool load(void* library, EglFunctions& egl) {
  const auto get = [&](auto& function, const char* name) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(library, name));
    return function != nullptr;
  };
  return get(egl.get_proc_address, "eglGetProcAddress") && get(egl.query_string, "eglQueryString") &&
         get(egl.get_error, "eglGetError") && get(egl.initialize, "eglInitialize") &&
         get(egl.terminate, "eglTerminate") && get(egl.bind_api, "eglBindAPI") &&
         get(egl.choose_config, "eglChooseConfig") && get(egl.create_context, "eglCreateContext") &&
         get(egl.destroy_context, "eglDestroyContext") && get(egl.make_current, "eglMakeCurrent");
}

bool has(const char* extensions, const char* name) { return extensions && std::strstr(extensions, name); }

/// GPUs first, then the surfaceless platform, then software devices: takes the first that initializes.
std::vector<EGLDisplay> candidate_displays(const EglFunctions& egl) {
  const char* client = egl.query_string(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto get_platform_display =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(egl.get_proc_address("eglGetPlatformDisplayEXT"));
  const auto query_devices =
      reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(egl.get_proc_address("eglQueryDevicesEXT"));
  const auto query_device =
      reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(egl.get_proc_address("eglQueryDeviceStringEXT"));
  std::vector<EGLDisplay> hardware, software, all;
  if (!get_platform_display) return all;
  EGLDeviceEXT devices[16];
  EGLint count = 0;
  if (has(client, "EGL_EXT_platform_device") && query_devices && query_device &&
      query_devices(16, devices, &count)) {
    for (EGLint i = 0; i < count; ++i) {
      const bool is_software = has(query_device(devices[i], EGL_EXTENSIONS), "EGL_MESA_device_software");
      const EGLDisplay display = get_platform_display(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr);
      if (display != EGL_NO_DISPLAY) (is_software ? software : hardware).push_back(display);
    }
  }
  all = hardware;
  if (has(client, "EGL_MESA_platform_surfaceless"))
    all.push_back(get_platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  all.insert(all.end(), software.begin(), software.end());
  return all;
}

/// Software GL would use every core, and the tick needs one. A user's own setting has priority.
void leave_a_core_to_the_tick() {
  const unsigned cores = std::max(2U, std::thread::hardware_concurrency());
  setenv("LP_NUM_THREADS", std::to_string(std::min(cores - 1, 8U)).c_str(), 0);
}

}  // namespace

/// One EGL display per process, kept to its end: terminating it would destroy the contexts of others, and
/// unload a driver that is needed again at once.
struct EglContext::Display {
  void* library = nullptr;
  EglFunctions egl{};
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLConfig config = nullptr;

  Display() = default;
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;

  static Result<std::shared_ptr<Display>> open(const std::string& library_name);
  bool initialize(EGLDisplay candidate);
};

bool EglContext::Display::initialize(EGLDisplay candidate) {
  EGLint major = 0, minor = 0;
  if (candidate == EGL_NO_DISPLAY || !egl.initialize(candidate, &major, &minor)) return false;
  const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
  EGLint count = 0;
  if (!has(egl.query_string(candidate, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context") ||
      !egl.bind_api(EGL_OPENGL_ES_API) || !egl.choose_config(candidate, wanted, &config, 1, &count) ||
      count < 1) {
    egl.terminate(candidate);
    return false;
  }
  display = candidate;
  return true;
}

Result<std::shared_ptr<EglContext::Display>> EglContext::Display::open(const std::string& library_name) {
  static std::mutex mutex;
  static auto& shared = *new std::shared_ptr<Display>;
  static std::string shared_name;
  const std::scoped_lock lock(mutex);
  if (shared && shared_name == library_name) return shared;
  auto opened = std::make_shared<Display>();
  // Never unloaded: drivers leave thread-local destructors behind.
  opened->library = dlopen(library_name.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (!opened->library) return Error{"rendering: " + library_name + " cannot be loaded" + kWhatToDo};
  if (!load(opened->library, opened->egl))
    return Error{"rendering: " + library_name + " is no EGL 1.4 library" + kWhatToDo};
  leave_a_core_to_the_tick();
  for (const EGLDisplay candidate : candidate_displays(opened->egl)) {
    if (!opened->initialize(candidate)) continue;
    shared = opened;
    shared_name = library_name;
    return opened;
  }
  return Error{
      std::string("rendering: EGL has neither a device nor Mesa's surfaceless platform with OpenGL ES 3") +
      kWhatToDo};
}

Result<std::unique_ptr<EglContext>> EglContext::create(const std::string& library) {
  auto display = Display::open(library);
  if (!display) return display.error();
  std::unique_ptr<EglContext> context(new EglContext);
  context->display_ = *display;
  const EglFunctions& egl = context->display_->egl;
  egl.bind_api(EGL_OPENGL_ES_API);
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 1, EGL_NONE};
  context->context_ =
      egl.create_context(context->display_->display, context->display_->config, EGL_NO_CONTEXT, attributes);
  if (!context->context_)
    return Error{std::string("rendering: the driver has no OpenGL ES 3.1 context") + kWhatToDo};
  context->make_current();
  Gl& gl = context->gl_;
#define PARHELION_GL_LOAD(name, type)                                 \
  gl.name = reinterpret_cast<type>(egl.get_proc_address("gl" #name)); \
  if (!gl.name) return Error{std::string("rendering: the driver lacks gl" #name) + kWhatToDo};
  PARHELION_GL_FUNCTIONS(PARHELION_GL_LOAD)
#undef PARHELION_GL_LOAD
  const auto* renderer = reinterpret_cast<const char*>(gl.GetString(GL_RENDERER));
  if (!renderer) return Error{std::string("rendering: the OpenGL ES context cannot be used") + kWhatToDo};
  context->renderer_ = renderer;
  return context;
}

EglContext::~EglContext() {
  if (!context_) return;
  display_->egl.make_current(display_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  display_->egl.destroy_context(display_->display, context_);
}

void EglContext::make_current() {
  display_->egl.make_current(display_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_);
}

}  // namespace parhelion::render
