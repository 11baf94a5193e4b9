#include "server/access/tls.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/time/time.h>
#include <grpc/grpc.h>
#include <openssl/asn1.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <ctime>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/access/secret_file.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

struct Free {
  void operator()(BIO* bio) const { BIO_free(bio); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};
using Bio = std::unique_ptr<BIO, Free>;
using Certificate = std::unique_ptr<X509, Free>;
using Key = std::unique_ptr<EVP_PKEY, Free>;

Bio Open(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

absl::Status Problem(const char* setting, const std::string& path, const std::string& what) {
  return InvalidArgument(setting, " ", path, ": ", what);
}

// Returns all certificates of a file, at least one.
absl::StatusOr<std::vector<Certificate>> ParseCertificates(const std::string& text,
                                                           const char* setting,
                                                           const std::string& path) {
  ERR_clear_error();
  const Bio bio = Open(text);
  std::vector<Certificate> certificates;
  while (X509* certificate = PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr)) {
    certificates.emplace_back(certificate);
  }
  const unsigned long error = ERR_peek_last_error();
  ERR_clear_error();
  const bool at_end =
      ERR_GET_LIB(error) == ERR_LIB_PEM && ERR_GET_REASON(error) == PEM_R_NO_START_LINE;
  if (!at_end) {
    return Problem(setting, path,
                   absl::StrCat("PEM certificate ", certificates.size() + 1, " is damaged"));
  }
  if (certificates.empty()) return Problem(setting, path, "it contains no PEM certificate");
  return certificates;
}

// Supplies no passphrase, so that loading an encrypted key fails.
int NoPassphrase(char*, int, int, void*) { return -1; }

absl::StatusOr<Key> ParseKey(const std::string& text, const std::string& path) {
  ERR_clear_error();
  const Bio bio = Open(text);
  Key key(PEM_read_bio_PrivateKey(bio.get(), nullptr, NoPassphrase, nullptr));
  ERR_clear_error();
  if (key != nullptr) return key;
  const bool encrypted = text.find("ENCRYPTED") != std::string::npos;
  return Problem("--tls-key", path,
                 encrypted ? "the key is encrypted; use one without a passphrase"
                           : "it contains no valid PEM private key");
}

std::chrono::system_clock::time_point TimeOf(const ASN1_TIME* time) {
  std::tm utc = {};
  if (ASN1_TIME_to_tm(time, &utc) != 1) return {};
  return std::chrono::system_clock::from_time_t(timegm(&utc));
}

std::string Contents(const Bio& bio) {
  char* text = nullptr;
  const long length = BIO_get_mem_data(bio.get(), &text);
  return std::string(text, static_cast<size_t>(length));
}

std::string SubjectOf(const X509* certificate) {
  const Bio bio(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(bio.get(), X509_get_subject_name(certificate), 0, XN_FLAG_ONELINE);
  return Contents(bio);
}

}  // namespace

absl::StatusOr<TlsIdentity> LoadTlsIdentity(const Config& config) {
  if (config.tls_cert.empty()) {
    return InvalidArgument(
        config.tls_key.empty() ? "--tls-client-ca" : "--tls-key",
        " requires --tls-cert, the server's certificate; set all of them or none");
  }
  if (config.tls_key.empty()) {
    return InvalidArgument("--tls-cert requires --tls-key, its private key; set both");
  }
  TlsIdentity identity;
  HULLD_ASSIGN_OR_RETURN(identity.certificates, ReadSettingFile(config.tls_cert, "--tls-cert"));
  HULLD_ASSIGN_OR_RETURN(const auto chain,
                         ParseCertificates(identity.certificates, "--tls-cert", config.tls_cert));
  HULLD_ASSIGN_OR_RETURN(identity.key, ReadSecretFile(config.tls_key, "--tls-key"));
  HULLD_ASSIGN_OR_RETURN(const Key key, ParseKey(identity.key, config.tls_key));
  X509* const leaf = chain.front().get();
  if (X509_check_private_key(leaf, key.get()) != 1) {
    ERR_clear_error();
    return Problem("--tls-key", config.tls_key,
                   absl::StrCat("it does not belong to the first certificate of --tls-cert ",
                                config.tls_cert));
  }
  if (!config.tls_client_ca.empty()) {
    HULLD_ASSIGN_OR_RETURN(identity.client_authorities,
                           ReadSettingFile(config.tls_client_ca, "--tls-client-ca"));
    HULLD_RETURN_IF_ERROR(
        ParseCertificates(identity.client_authorities, "--tls-client-ca", config.tls_client_ca)
            .status());
  }
  identity.subject = SubjectOf(leaf);
  identity.not_before = TimeOf(X509_get0_notBefore(leaf));
  identity.not_after = TimeOf(X509_get0_notAfter(leaf));
  return identity;
}

bool HasLostAuthorities(const Config& config) {
  if (config.tls_client_ca.empty()) return false;
  if (IsMissing(config.tls_client_ca)) return true;
  const absl::StatusOr<std::string> text = ReadSettingFile(config.tls_client_ca, "--tls-client-ca");
  return text.ok() && text->find("-----BEGIN") == std::string::npos;
}

std::string FirstCertificate(const std::string& certificates) {
  const Bio text = Open(certificates);
  const Certificate first(PEM_read_bio_X509(text.get(), nullptr, nullptr, nullptr));
  const Bio copy(BIO_new(BIO_s_mem()));
  PEM_write_bio_X509(copy.get(), first.get());
  return Contents(copy);
}

absl::Status CheckValidity(const TlsIdentity& identity, std::chrono::system_clock::time_point now) {
  const bool expired = now > identity.not_after;
  if (!expired && now >= identity.not_before) return absl::OkStatus();
  return InvalidArgument("--tls-cert: the certificate of ", identity.subject,
                         expired ? " expired on " : " starts on ",
                         FormatTime(expired ? identity.not_after : identity.not_before),
                         "; clients will reject it; renew it");
}

std::string FormatTime(std::chrono::system_clock::time_point time) {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", absl::FromChrono(time), absl::UTCTimeZone());
}

TlsCredentials::TlsCredentials(TlsIdentity identity) : identity_(std::move(identity)) {
  const auto request = identity_.client_authorities.empty()
                           ? GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE
                           : GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY;
  credentials_ = grpc_ssl_server_credentials_create_with_options(
      grpc_ssl_server_credentials_create_options_using_config_fetcher(request, Fetch, this));
}

TlsCredentials::~TlsCredentials() { grpc_server_credentials_release(credentials_); }

void TlsCredentials::SetIdentity(TlsIdentity identity) {
  const std::lock_guard lock(mutex_);
  identity_ = std::move(identity);
  fetched_ = false;
}

void TlsCredentials::SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) {
}

grpc_ssl_certificate_config_reload_status TlsCredentials::Fetch(
    void* self, grpc_ssl_server_certificate_config** config) {
  auto* const credentials = static_cast<TlsCredentials*>(self);
  const std::lock_guard lock(credentials->mutex_);
  if (credentials->fetched_) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
  const TlsIdentity& identity = credentials->identity_;
  const grpc_ssl_pem_key_cert_pair pair = {identity.key.c_str(), identity.certificates.c_str()};
  // gRPC requires authorities even if it does not request client certificates.
  const bool has_authorities = !identity.client_authorities.empty();
  *config = grpc_ssl_server_certificate_config_create(
      (has_authorities ? identity.client_authorities : identity.certificates).c_str(), &pair, 1);
  credentials->fetched_ = true;
  return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
}

int TlsCredentials::AddPortToServer(const std::string& address, grpc_server* server) {
  return grpc_server_add_http2_port(server, address.c_str(), credentials_);
}

}  // namespace hulld::server
