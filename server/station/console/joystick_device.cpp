#include "server/station/console/joystick_device.hpp"

#include <SDL2/SDL.h>

#include <algorithm>

namespace parhelion::station {
namespace {

constexpr double kFull = 32767;  // maximum of a Sint16

std::string name_of(int index) {
  const char* name = SDL_JoystickNameForIndex(index);
  return name != nullptr ? name : "joystick";
}

double fraction(Sint16 value) { return std::clamp(value / kFull, -1.0, 1.0); }

struct CloseJoystick {
  void operator()(SDL_Joystick* joystick) const { SDL_JoystickClose(joystick); }
};
struct CloseController {
  void operator()(SDL_GameController* controller) const { SDL_GameControllerClose(controller); }
};

}  // namespace

struct JoystickPort::State {
  std::unique_ptr<SDL_Joystick, CloseJoystick> joystick;
  std::unique_ptr<SDL_GameController, CloseController> controller;
  std::string name;

  void release() {
    controller.reset();
    joystick.reset();
    name.clear();
  }
  void use(int index) {
    joystick.reset(SDL_JoystickOpen(index));
    if (!joystick) return;
    name = name_of(index);
    if (SDL_IsGameController(index) == SDL_TRUE) controller.reset(SDL_GameControllerOpen(index));
  }
  JoystickState read() const;
};

JoystickState JoystickPort::State::read() const {
  JoystickState state;
  for (int i = 0; i < SDL_JoystickNumAxes(joystick.get()); ++i)
    state.axes["axis " + std::to_string(i)] = fraction(SDL_JoystickGetAxis(joystick.get(), i));
  for (int i = 0; i < SDL_JoystickNumButtons(joystick.get()); ++i)
    state.buttons["button " + std::to_string(i)] = SDL_JoystickGetButton(joystick.get(), i) != 0;
  if (!controller) return state;
  for (int i = 0; i < SDL_CONTROLLER_AXIS_MAX; ++i) {
    const auto axis = static_cast<SDL_GameControllerAxis>(i);
    if (SDL_GameControllerHasAxis(controller.get(), axis) == SDL_TRUE)
      state.axes[SDL_GameControllerGetStringForAxis(axis)] =
          fraction(SDL_GameControllerGetAxis(controller.get(), axis));
  }
  for (int i = 0; i < SDL_CONTROLLER_BUTTON_MAX; ++i) {
    const auto button = static_cast<SDL_GameControllerButton>(i);
    if (SDL_GameControllerHasButton(controller.get(), button) == SDL_TRUE)
      state.buttons[SDL_GameControllerGetStringForButton(button)] =
          SDL_GameControllerGetButton(controller.get(), button) != 0;
  }
  return state;
}

JoystickPort::JoystickPort(std::unique_ptr<State> state) : state_(std::move(state)) {}

Result<std::unique_ptr<JoystickPort>> JoystickPort::open() {
  // A console has no window for the focus, and handles ^C itself.
  SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  if (SDL_Init(SDL_INIT_JOYSTICK | SDL_INIT_GAMECONTROLLER) != 0)
    return Error{std::string("no joysticks through SDL: ") + SDL_GetError()};
  return std::unique_ptr<JoystickPort>(new JoystickPort(std::make_unique<State>()));
}

JoystickPort::~JoystickPort() {
  state_->release();
  SDL_Quit();
}

std::vector<JoystickName> JoystickPort::list() {
  SDL_JoystickUpdate();
  std::vector<JoystickName> all;
  for (int i = 0; i < SDL_NumJoysticks(); ++i) {
    JoystickName found{name_of(i), SDL_IsGameController(i) == SDL_TRUE, 0, 0};
    const std::unique_ptr<SDL_Joystick, CloseJoystick> joystick(SDL_JoystickOpen(i));
    if (joystick) {
      found.axes = SDL_JoystickNumAxes(joystick.get());
      found.buttons = SDL_JoystickNumButtons(joystick.get());
    }
    all.push_back(std::move(found));
  }
  return all;
}

std::optional<JoystickState> JoystickPort::poll(const std::string& name) {
  SDL_Event event;
  while (SDL_PollEvent(&event) != 0) {
  }
  SDL_JoystickUpdate();
  if (state_->joystick && SDL_JoystickGetAttached(state_->joystick.get()) != SDL_TRUE) state_->release();
  for (int i = 0; !state_->joystick && i < SDL_NumJoysticks(); ++i) {
    if (name_of(i).find(name) != std::string::npos) state_->use(i);
  }
  if (!state_->joystick) return std::nullopt;
  return state_->read();
}

std::string JoystickPort::in_use() const { return state_->name; }

}  // namespace parhelion::station
