#include "server/runtime/outbox.hpp"

namespace parhelion::runtime {

Outbox::Outbox(Bus* bus, std::optional<LogWriter> log, SentMessages* sent)
    : bus_(bus), sent_(sent), log_(std::move(log)) {}

void Outbox::write(std::span<const Message> messages) {
  if (!log_ || !log_error_.empty()) return;
  if (const Status written = log_->write(messages); !written) log_error_ = written.error().message;
}

void Outbox::send(const Message* input, std::span<const tick::Outputs::Entry> outputs, ArrivalTime stamp,
                  const Message* note) {
  record(input, outputs, stamp, note);
  if (bus_ == nullptr) return;
  for (const tick::Outputs::Entry& output : outputs) {
    // Continue without a receiver; the bus counts failed sends.
    if (output.sent) continue;
    if (sent_ != nullptr) sent_->add(output.channel, output.payload);
    (void)bus_->publish(output.channel, output.payload);
  }
}

void Outbox::record(const Message* input, std::span<const tick::Outputs::Entry> outputs, ArrivalTime stamp,
                    const Message* note) {
  const std::lock_guard lock(mutex_);
  batch_.resize(outputs.size() + (input != nullptr ? 1 : 0) + (note != nullptr ? 1 : 0));
  std::size_t used = 0;
  if (input != nullptr) batch_[used++] = *input;
  for (const tick::Outputs::Entry& output : outputs) {
    Message& message = batch_[used++];
    message.channel = output.channel;
    message.arrival = stamp;
    message.payload.assign(output.payload.begin(), output.payload.end());
    hashes_[output.channel].add(output.payload);
  }
  if (note != nullptr) batch_[used] = *note;
  write(batch_);
}

void Outbox::publish_now(std::string_view channel, std::span<const std::uint8_t> payload) {
  // Without the lock: the guard must not wait for a slow disk.
  if (bus_ == nullptr) return;
  if (sent_ != nullptr) sent_->add(channel, payload);
  (void)bus_->publish(channel, payload);
}

bool Outbox::write_input(const Message& input) {
  const std::lock_guard lock(mutex_);
  write({&input, 1});
  return log_error_.empty();
}

Status Outbox::sync() {
  {
    const std::lock_guard lock(mutex_);
    if (!log_ || !log_error_.empty()) return {};
  }
  Status synced = log_->sync();
  if (!synced) give_up_log(synced.error().message);
  return synced;
}

void Outbox::give_up_log(const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (log_error_.empty()) log_error_ = reason;
}

bool Outbox::complete() const {
  const std::lock_guard lock(mutex_);
  return log_error_.empty();
}

std::string Outbox::log_error() const {
  const std::lock_guard lock(mutex_);
  return log_error_;
}

std::map<std::string, std::string> Outbox::hashes() const {
  const std::lock_guard lock(mutex_);
  std::map<std::string, std::string> hex;
  for (const auto& [channel, hash] : hashes_) hex[channel] = hash.hex();
  return hex;
}

}  // namespace parhelion::runtime
