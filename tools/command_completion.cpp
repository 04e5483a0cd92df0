// parhelion completion: shell completion.
#include <cstdio>

#include "tools/completion.hpp"

namespace parhelion::tools {

void add_completion(CLI::App& app, Exit&) {
  CLI::App* command = app.add_subcommand("completion", "Print a script that completes commands in a shell");
  auto shell = std::make_shared<std::string>("bash");
  command->add_option("shell", *shell, "Which shell")->check(CLI::IsMember({"bash"}))->capture_default_str();
  command->footer("Example: source <(parhelion completion bash)      (in ~/.bashrc, for every shell)");
  command->callback([&app, shell] { std::fputs(bash_completion(app).c_str(), stdout); });
}

}  // namespace parhelion::tools
