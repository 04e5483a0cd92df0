#include "server/station/http/certificate.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>

#include "server/station/http/private_file.hpp"

namespace parhelion::station {
namespace {

template <auto release>
struct Release {
  template <class T>
  void operator()(T* object) const {
    release(object);
  }
};
using Key = std::unique_ptr<EVP_PKEY, Release<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Release<X509_free>>;
using Memory = std::unique_ptr<BIO, Release<BIO_free_all>>;

constexpr long kDay = 24 * 3600;

std::string text_of(BIO* memory) {
  char* bytes = nullptr;
  const long size = BIO_get_mem_data(memory, &bytes);
  return {bytes, static_cast<std::size_t>(size)};
}

Result<Certificate> read_certificate(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  const std::string pem = text.str();
  const Memory memory(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  Certificate certificate(PEM_read_bio_X509(memory.get(), nullptr, nullptr, nullptr));
  if (!certificate) {
    return Error{path.string() +
                 ": not a certificate in PEM; restore a copy, or remove it and its key for a new one"};
  }
  return certificate;
}

bool is_address(const std::string& name) {
  std::array<unsigned char, 16> bytes{};
  return inet_pton(AF_INET, name.c_str(), bytes.data()) == 1 ||
         inet_pton(AF_INET6, name.c_str(), bytes.data()) == 1;
}

bool extend(X509* certificate, int what, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Release<X509_EXTENSION_free>> extension(
      X509V3_EXT_conf_nid(nullptr, &context, what, value.c_str()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

Certificate sign_new(EVP_PKEY* key, const std::vector<std::string>& names, WallTime now) {
  Certificate certificate(X509_new());
  std::array<unsigned char, 16> serial{};
  if (!certificate || RAND_bytes(serial.data(), static_cast<int>(serial.size())) != 1) return nullptr;
  serial[0] &= 0x7f;
  const std::unique_ptr<BIGNUM, Release<BN_free>> number(
      BN_bin2bn(serial.data(), static_cast<int>(serial.size()), nullptr));
  BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate.get()));
  X509_set_version(certificate.get(), 2);
  const std::time_t from = static_cast<std::time_t>(now.ns / 1'000'000'000);
  // Tolerates tablets with wrong clocks.
  ASN1_TIME_adj(X509_getm_notBefore(certificate.get()), from, -1, 0);
  ASN1_TIME_adj(X509_getm_notAfter(certificate.get()), from, 730, 0);
  X509_set_pubkey(certificate.get(), key);
  X509_NAME* subject = X509_get_subject_name(certificate.get());
  X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>("Parhelion"),
                             -1, -1, 0);
  X509_set_issuer_name(certificate.get(), subject);
  std::string alternatives;
  for (const std::string& name : names) {
    alternatives += (alternatives.empty() ? "" : ",") + std::string(is_address(name) ? "IP:" : "DNS:") + name;
  }
  const bool extended = extend(certificate.get(), NID_basic_constraints, "critical,CA:FALSE") &&
                        extend(certificate.get(), NID_key_usage, "critical,digitalSignature") &&
                        extend(certificate.get(), NID_ext_key_usage, "serverAuth") &&
                        extend(certificate.get(), NID_subject_alt_name, alternatives);
  if (!extended || X509_sign(certificate.get(), key, EVP_sha256()) == 0) return nullptr;
  return certificate;
}

}  // namespace

Status make_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key,
                        const std::vector<std::string>& names, WallTime now) {
  const bool has_certificate = std::filesystem::exists(certificate), has_key = std::filesystem::exists(key);
  if (has_certificate != has_key) {
    return Error{(has_key ? key : certificate).string() + " exists, but " +
                 (has_key ? certificate : key).string() +
                 " does not; restore it, or remove both to have new ones made"};
  }
  if (has_certificate) {
    const Result<Certificate> known = read_certificate(certificate);
    if (!known) return known.error();
    std::time_t soon = static_cast<std::time_t>(now.ns / 1'000'000'000) + 30 * kDay;
    if (X509_cmp_time(X509_get0_notAfter(known->get()), &soon) > 0) return {};
  }
  const Key made(EVP_EC_gen("P-256"));
  const Certificate signed_by_itself = made ? sign_new(made.get(), names, now) : nullptr;
  if (!signed_by_itself) return Error{certificate.string() + ": OpenSSL could not make a certificate"};
  const Memory key_text(BIO_new(BIO_s_mem())), certificate_text(BIO_new(BIO_s_mem()));
  PEM_write_bio_PrivateKey(key_text.get(), made.get(), nullptr, nullptr, 0, nullptr, nullptr);
  PEM_write_bio_X509(certificate_text.get(), signed_by_itself.get());
  if (const Status written = write_private_file(key, text_of(key_text.get())); !written) return written;
  return write_private_file(certificate, text_of(certificate_text.get()));
}

Result<std::string> certificate_fingerprint(const std::filesystem::path& certificate) {
  const Result<Certificate> known = read_certificate(certificate);
  if (!known) return known.error();
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (X509_digest(known->get(), EVP_sha256(), digest.data(), &size) != 1) {
    return Error{certificate.string() + ": has no fingerprint"};
  }
  std::string text;
  for (unsigned i = 0; i < size; ++i) {
    constexpr std::string_view digits = "0123456789ABCDEF";
    if (i > 0) text += ':';
    text += digits[digest.at(i) >> 4U];
    text += digits[digest.at(i) & 15U];
  }
  return text;
}

std::vector<std::string> own_names() {
  std::set<std::string> names = {"localhost", "127.0.0.1", "::1"};
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) == 0 && host[0] != '\0') {
    names.insert(host.data());
    names.insert(std::string(host.data()) + ".local");
  }
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) == 0) {
    for (const ifaddrs* one = all; one; one = one->ifa_next) {
      if (!one->ifa_addr) continue;
      std::array<char, INET6_ADDRSTRLEN> text{};
      if (one->ifa_addr->sa_family == AF_INET) {
        inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text.data(),
                  text.size());
      } else if (one->ifa_addr->sa_family == AF_INET6) {
        inet_ntop(AF_INET6, &reinterpret_cast<const sockaddr_in6*>(one->ifa_addr)->sin6_addr, text.data(),
                  text.size());
      }
      if (text[0] != '\0') names.insert(text.data());
    }
    freeifaddrs(all);
  }
  return {names.begin(), names.end()};
}

}  // namespace parhelion::station
