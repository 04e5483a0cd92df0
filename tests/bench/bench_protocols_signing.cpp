// What a signature costs, and what its alternatives would: a scan of 541 beams with intensities, and an
// image.
#include <benchmark/benchmark.h>
#include <sodium.h>

#include "protocols/authentication/signature.hpp"

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes message_of(const benchmark::State& state) { return Bytes(static_cast<std::size_t>(state.range(0)), 7); }

void sign_and_verify(benchmark::State& state) {
  const Bytes payload = message_of(state);
  const parhelion::Sender rover{"rover", parhelion::new_secret(), {"robot"}, {}};
  parhelion::Signer signer(rover.name, rover.secret);
  parhelion::Verifier verifier({"server", parhelion::new_secret(), parhelion::seconds(1.0), {rover}});
  const parhelion::SensorTime now{1'700'000'000'000'000'000};
  Bytes message;
  for (auto _ : state) {
    signer.sign("SCAN", payload, now, message);
    if (verifier.verify("SCAN", message, now).fault) state.SkipWithError("refused");
  }
}

void ed25519(benchmark::State& state) {
  const Bytes payload = message_of(state);
  Bytes known(crypto_sign_PUBLICKEYBYTES), secret(crypto_sign_SECRETKEYBYTES), signature(crypto_sign_BYTES);
  crypto_sign_keypair(known.data(), secret.data());
  for (auto _ : state) {
    crypto_sign_detached(signature.data(), nullptr, payload.data(), payload.size(), secret.data());
    if (crypto_sign_verify_detached(signature.data(), payload.data(), payload.size(), known.data()) != 0)
      state.SkipWithError("refused");
  }
}

void blake2b(benchmark::State& state) {
  const Bytes payload = message_of(state);
  Bytes key(32, 1), made(16), expected(16);
  for (auto _ : state) {
    for (Bytes* tag : {&made, &expected})
      crypto_generichash(tag->data(), tag->size(), payload.data(), payload.size(), key.data(), key.size());
    if (sodium_memcmp(made.data(), expected.data(), made.size()) != 0) state.SkipWithError("refused");
  }
}

void hmac_sha512_256(benchmark::State& state) {
  const Bytes payload = message_of(state);
  Bytes key(crypto_auth_KEYBYTES, 1), tag(crypto_auth_BYTES);
  for (auto _ : state) {
    crypto_auth(tag.data(), payload.data(), payload.size(), key.data());
    if (crypto_auth_verify(tag.data(), payload.data(), payload.size(), key.data()) != 0)
      state.SkipWithError("refused");
  }
}

constexpr int kScan = 4368, kImage = 1 << 20;  // bytes
BENCHMARK(sign_and_verify)->Arg(kScan)->Arg(kImage)->Unit(benchmark::kMicrosecond);
BENCHMARK(blake2b)->Arg(kScan)->Arg(kImage)->Unit(benchmark::kMicrosecond);
BENCHMARK(hmac_sha512_256)->Arg(kScan)->Arg(kImage)->Unit(benchmark::kMicrosecond);
BENCHMARK(ed25519)->Arg(kScan)->Arg(kImage)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
