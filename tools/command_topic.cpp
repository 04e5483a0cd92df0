// `parhelion topic`: shows the messages on the bus or in a log.
#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <string>

#include "protocols/bus/log_file.hpp"
#include "protocols/nearest_name.hpp"
#include "tools/channel_statistics.hpp"
#include "tools/command.hpp"
#include "tools/topic_text.hpp"

namespace parhelion::tools {
namespace {

volatile std::sig_atomic_t interrupted = 0;

void interrupt(int) { interrupted = 1; }

/// ^C ends the subscription, so that the summary is printed.
void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = interrupt;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

struct Arguments {
  std::string url;
  std::string log;
  std::string channel = ".*";
  double seconds = 0;  ///< 0: until ^C or the log's end
  std::uint64_t count = 0;
};

using Clock = std::chrono::steady_clock;
using Statistics = std::map<std::string, ChannelStatistics>;

/// Passes each message to `take` until it returns false; `idle` is called periodically, on the bus only.
Exit listen_to_bus(const Arguments& arguments, const std::function<bool(const Message&)>& take,
                   const std::function<void()>& idle) {
  auto bus = open_network_bus(arguments.url);
  if (!bus) return std::fprintf(stderr, "parhelion topic: %s\n", bus.error().message.c_str()), Exit::failed;
  if (const Status status = (*bus)->subscribe(arguments.channel, 1000); !status) {
    return std::fprintf(stderr, "parhelion topic: %s\n", status.error().message.c_str()), Exit::usage;
  }
  catch_interrupts();
  const auto start = Clock::now();
  Message message;
  while (interrupted == 0) {
    if (arguments.seconds > 0 && Clock::now() - start >= std::chrono::duration<double>(arguments.seconds))
      break;
    const auto came = (*bus)->receive(message, milliseconds(50));
    if (!came)
      return std::fprintf(stderr, "parhelion topic: %s\n", came.error().message.c_str()), Exit::failed;
    if (*came && !take(message)) break;
    idle();
  }
  if ((*bus)->dropped() > 0) {
    std::fprintf(stderr, "parhelion topic: %llu messages were dropped: too many to process\n",
                 static_cast<unsigned long long>((*bus)->dropped()));
  }
  return Exit::done;
}

/// The same for a log. Damage is reported and sets exit code 1; reading continues behind it.
Exit listen_to_log(const Arguments& arguments, const std::function<bool(const Message&)>& take) {
  std::regex pattern;
  try {
    pattern = std::regex(arguments.channel);
  } catch (const std::regex_error& error) {
    std::fprintf(stderr, "parhelion topic: channel '%s': not a regular expression: %s\n",
                 arguments.channel.c_str(), error.what());
    return Exit::usage;
  }
  auto reader = LogReader::open(arguments.log);
  if (!reader)
    return std::fprintf(stderr, "parhelion topic: %s\n", reader.error().message.c_str()), Exit::failed;
  catch_interrupts();
  Exit exit = Exit::done;
  ArrivalTime first{-1};
  while (interrupted == 0) {
    const auto event = reader->next();
    if (!event) {
      std::fprintf(stderr, "parhelion topic: %s\n", event.error().message.c_str());
      exit = Exit::failed;
      continue;
    }
    if (!event->has_value()) break;
    const Message& message = **event;
    if (first.ns < 0) first = message.arrival;
    if (arguments.seconds > 0 && (message.arrival - first).seconds() > arguments.seconds) break;
    if (std::regex_match(message.channel, pattern) && !take(message)) break;
  }
  return exit;
}

Exit listen(
    const Arguments& arguments, const std::function<bool(const Message&)>& take,
    const std::function<void()>& idle = [] {}) {
  return arguments.log.empty() ? listen_to_bus(arguments, take, idle) : listen_to_log(arguments, take);
}

Exit list(const Arguments& arguments) {
  Statistics channels;
  const Exit exit = listen(arguments, [&](const Message& message) {
    channels[message.channel].add(message);
    return true;
  });
  if (exit == Exit::usage || (exit == Exit::failed && channels.empty())) return exit;
  std::printf("%-28s %-20s %10s %10s %12s\n", "channel", "type", "messages", "Hz", "bytes each");
  for (const auto& [name, channel] : channels) {
    std::printf("%-28s %-20s %10llu %10.2f %12.0f\n", printable(name).c_str(), channel.type().c_str(),
                static_cast<unsigned long long>(channel.count()), channel.rate(),
                static_cast<double>(channel.bytes()) / static_cast<double>(channel.count()));
  }
  if (channels.empty()) {
    std::fprintf(stderr, "parhelion topic list: no messages received%s\n",
                 arguments.log.empty() ? "; is the sender on the same url and ttl?" : "");
  }
  return exit;
}

/// What to do when no message came.
std::string no_message(const Arguments& arguments) {
  const std::string on = "no message on '" + arguments.channel + "'";
  if (arguments.log.empty())
    return on + "; `parhelion topic list` lists the channels. Is the sender on the same url and ttl?";
  std::set<std::string> channels;
  if (auto reader = LogReader::open(arguments.log)) {
    for (auto event = reader->next(); event && event->has_value(); event = reader->next())
      channels.insert((*event)->channel);
  }
  return on + suggestion_or_known(arguments.channel, {channels.begin(), channels.end()});
}

Exit echo(const Arguments& arguments) {
  std::uint64_t shown = 0;
  const Exit exit = listen(arguments, [&](const Message& message) {
    const auto us = message.arrival.utime();
    std::printf("%lld.%06lld %s %s\n", static_cast<long long>(us / 1'000'000),
                static_cast<long long>(us % 1'000'000), printable(message.channel).c_str(),
                echo_text(message).c_str());
    std::fflush(stdout);
    return ++shown != arguments.count;
  });
  if (shown > 0 || exit != Exit::done) return exit;
  std::fprintf(stderr, "parhelion topic echo: %s\n", no_message(arguments).c_str());
  return Exit::failed;
}

void print_rates(const Statistics& channels) {
  for (const auto& [name, channel] : channels) {
    if (channel.count() < 2) {
      std::printf("%-28s        - Hz  messages %llu\n", printable(name).c_str(),
                  static_cast<unsigned long long>(channel.count()));
      continue;
    }
    std::printf("%-28s %8.2f Hz  jitter %.3f ms  min %.3f  max %.3f ms  messages %llu  missing about %llu\n",
                printable(name).c_str(), channel.rate(), channel.jitter() * 1e3, channel.shortest() * 1e3,
                channel.longest() * 1e3, static_cast<unsigned long long>(channel.count()),
                static_cast<unsigned long long>(channel.lost()));
  }
  std::fflush(stdout);
}

/// On the bus: the rates of each second while it runs, and those of the whole time at the end.
Exit hz(const Arguments& arguments) {
  Statistics whole, latest;
  auto next_print = Clock::now() + std::chrono::seconds(1);
  const auto take = [&](const Message& message) {
    whole[message.channel].add(message);
    if (arguments.log.empty()) latest[message.channel].add(message);
    return true;
  };
  const Exit exit = listen(arguments, take, [&] {
    if (Clock::now() < next_print) return;
    next_print += std::chrono::seconds(1);
    print_rates(latest);
    latest.clear();
  });
  if (whole.empty()) {
    std::fprintf(stderr, "parhelion topic hz: no messages received\n");
    return exit;
  }
  if (arguments.log.empty()) std::printf("whole time:\n");
  print_rates(whole);
  return exit;
}

CLI::App* add(CLI::App& topic, const char* name, const char* what, Exit (*run)(const Arguments&),
              Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = topic.add_subcommand(name, what);
  command->add_option("CHANNEL", arguments->channel, "Channel or regular expression (all)");
  auto* url =
      command->add_option("--url", arguments->url, "LCM url ($LCM_DEFAULT_URL, else this machine only)");
  command->add_option("--log", arguments->log, "An LCM log instead of the bus")->excludes(url);
  auto* seconds = command->add_option("--seconds", arguments->seconds,
                                      run == list ? "Duration, s (2 on the bus, a log to its end)"
                                                  : "Duration, s (until ^C, or the log's end)");
  seconds->check(CLI::PositiveNumber);
  if (run == echo) command->add_option("-n,--count", arguments->count, "Number of messages");
  command->callback([arguments, run, seconds, &exit] {
    if (run == list && arguments->log.empty() && seconds->count() == 0) arguments->seconds = 2;
    exit = run(*arguments);
  });
  return command;
}

}  // namespace

void add_topic(CLI::App& app, Exit& exit) {
  CLI::App* topic = app.add_subcommand("topic", "Show messages on the bus or in a log: list, echo, hz");
  topic->require_subcommand(1);
  topic->footer("Example:\n  parhelion topic list --log session.lcm");
  add(*topic, "list", "Channels with type, count, rate and size", list, exit)
      ->footer("Example:\n  parhelion topic list\n  parhelion topic list --log session.lcm");
  add(*topic, "echo", "Prints messages, decoded by their fingerprint", echo, exit)
      ->footer(
          "Example:\n  parhelion topic echo MR_EVENTS\n  parhelion topic echo SCAN -n 1 --log session.lcm");
  add(*topic, "hz", "Rate, jitter and estimated losses", hz, exit)
      ->footer("Example:\n  parhelion topic hz MR_SCAN --seconds 10");
}

}  // namespace parhelion::tools
