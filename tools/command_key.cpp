// parhelion key: the keys of a bus with authentication.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "protocols/authentication/keys.hpp"
#include "server/station/http/private_file.hpp"
#include "tools/command.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  std::string name, server = "server.keys", output;
  std::vector<std::string> roles, channels, listens;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion key: %s\n", what.c_str());
  return Exit::failed;
}

const Sender* find(const Keys& keys, const std::string& name) {
  const auto at = std::find_if(keys.senders.begin(), keys.senders.end(),
                               [&](const Sender& sender) { return sender.name == name; });
  return at == keys.senders.end() ? nullptr : &*at;
}

/// The server's keys; new ones where the file does not exist.
Result<Keys> server_keys(const std::string& path) {
  if (access(path.c_str(), F_OK) != 0) return Keys{"server", new_secret(), seconds(1.0), {}};
  return load_keys(path);
}

Status write(const Keys& keys, const std::string& path) {
  return station::write_private_file(
      path, "# Secret. Whoever reads this file can send in the name of each sender in it.\n" + to_yaml(keys));
}

/// The file of a new sender: it accepts the server, and whom it listens to besides.
Result<Keys> keys_of_sender(const Sender& sender, const Keys& server,
                            const std::vector<std::string>& listens) {
  Keys keys{sender.name, sender.secret, server.clock, {{server.name, server.secret, {"server"}, {}}}};
  for (const std::string& name : listens) {
    const Sender* other = find(server, name);
    if (other == nullptr)
      return Error{"--listens " + name + ": no sender of that name; see: parhelion key list"};
    keys.senders.push_back(*other);
  }
  return keys;
}

Exit make(const Arguments& arguments) {
  auto server = server_keys(arguments.server);
  if (!server) return fail(server.error().message);
  if (arguments.name == server->name || find(*server, arguments.name) != nullptr)
    return fail("'" + arguments.name + "' is already in " + arguments.server +
                "; remove it first: parhelion key remove " + arguments.name);
  if (arguments.roles.empty() && arguments.channels.empty())
    return fail("give --role or --channel: what may '" + arguments.name + "' publish?");
  const Sender sender{arguments.name, new_secret(), arguments.roles, arguments.channels};
  const auto keys = keys_of_sender(sender, *server, arguments.listens);
  if (!keys) return fail(keys.error().message);
  const std::string output = arguments.output.empty() ? arguments.name + ".keys" : arguments.output;
  if (access(output.c_str(), F_OK) == 0) return fail(output + ": exists; give another --output");
  server->senders.push_back(sender);
  // As it will be read: a bad name or channel is refused before anything is written.
  if (const auto read = parse_keys(to_yaml(*server), arguments.server); !read)
    return fail(read.error().message);
  if (const Status written = write(*server, arguments.server); !written) return fail(written.error().message);
  if (const Status written = write(*keys, output); !written) return fail(written.error().message);
  std::printf(
      "%s: for the server: parhelion serve --keys %s\n%s: for '%s'; copy it there over a secure connection, "
      "with mode 600\n",
      arguments.server.c_str(), arguments.server.c_str(), output.c_str(), arguments.name.c_str());
  return Exit::done;
}

Exit list(const Arguments& arguments) {
  const auto keys = load_keys(arguments.server);
  if (!keys) return fail(keys.error().message);
  std::printf("%s (this file's own), clocks within %g s\n", keys->name.c_str(), keys->clock.seconds());
  for (const Sender& sender : keys->senders) {
    std::printf("%s:", sender.name.c_str());
    for (const std::string& role : sender.roles) std::printf(" %s", role.c_str());
    for (const std::string& channel : sender.channels) std::printf(" %s", channel.c_str());
    std::printf("\n");
  }
  return Exit::done;
}

Exit remove(const Arguments& arguments) {
  auto keys = load_keys(arguments.server);
  if (!keys) return fail(keys.error().message);
  const auto named = [&](const Sender& sender) { return sender.name == arguments.name; };
  if (std::erase_if(keys->senders, named) == 0)
    return fail("no sender '" + arguments.name + "' in " + arguments.server);
  if (const Status written = write(*keys, arguments.server); !written) return fail(written.error().message);
  std::printf("'%s' is refused by a server that starts from now on\n", arguments.name.c_str());
  return Exit::done;
}

}  // namespace

void add_key(CLI::App& app, Exit& exit) {
  CLI::App* command =
      app.add_subcommand("key", "Make, list and remove the keys of a bus with authentication");
  command->require_subcommand(1);
  auto arguments = std::make_shared<Arguments>();
  const auto add_server = [arguments](CLI::App& verb) {
    verb.add_option("--server", arguments->server, "The server's keys")->capture_default_str();
  };
  CLI::App* make_one =
      command->add_subcommand("new", "Make the keys of a sender, and let the server accept it");
  make_one->add_option("name", arguments->name, "Name of the sender")->required();
  make_one->add_option("--role", arguments->roles, "What it may publish; may be repeated")
      ->check(CLI::IsMember(sender_roles()));
  make_one->add_option("--channel", arguments->channels,
                       "A further channel that it may publish on, or a regular expression; may be repeated");
  make_one->add_option(
      "--listens", arguments->listens,
      "Another sender whose messages it accepts, as SLAM those of the robot; may be repeated");
  make_one->add_option("-o,--output", arguments->output, "File to write; by default NAME.keys");
  add_server(*make_one);
  make_one->footer(
      "Example: parhelion key new rover --role robot\n"
      "         parhelion key new slam --role localization --listens rover\n"
      "         parhelion key new ann --role trainee");
  make_one->callback([arguments, &exit] { exit = make(*arguments); });
  CLI::App* list_all = command->add_subcommand("list", "List the senders, without their secrets");
  add_server(*list_all);
  list_all->callback([arguments, &exit] { exit = list(*arguments); });
  CLI::App* remove_one = command->add_subcommand("remove", "Accept a sender no more");
  remove_one->add_option("name", arguments->name, "Name of the sender")->required();
  add_server(*remove_one);
  remove_one->callback([arguments, &exit] { exit = remove(*arguments); });
}

}  // namespace parhelion::tools
