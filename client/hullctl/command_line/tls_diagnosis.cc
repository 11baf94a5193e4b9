#include "client/hullctl/command_line/tls_diagnosis.h"

#include <arpa/inet.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <memory>

namespace hulld {
namespace {

constexpr int kTimeoutSeconds = 2;

struct Free {
  void operator()(BIO* bio) const { BIO_free_all(bio); }
  void operator()(SSL_CTX* context) const { SSL_CTX_free(context); }
  void operator()(SSL* ssl) const { SSL_free(ssl); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};
template <typename T>
using Owned = std::unique_ptr<T, Free>;

Owned<BIO> TextBio(const std::string& text) {
  return Owned<BIO>(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

Owned<SSL_CTX> MakeContext(const ConnectionSecurity& security) {
  Owned<SSL_CTX> context(SSL_CTX_new(TLS_client_method()));
  if (security.authorities.empty()) {
    SSL_CTX_set_default_verify_paths(context.get());
  } else {
    const Owned<BIO> bio = TextBio(security.authorities);
    while (const Owned<X509> authority{PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr)}) {
      X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), authority.get());
    }
  }
  const Owned<X509> certificate(
      PEM_read_bio_X509(TextBio(security.certificate).get(), nullptr, nullptr, nullptr));
  const Owned<EVP_PKEY> key(
      PEM_read_bio_PrivateKey(TextBio(security.key).get(), nullptr, nullptr, nullptr));
  if (certificate != nullptr && key != nullptr) {
    SSL_CTX_use_certificate(context.get(), certificate.get());
    SSL_CTX_use_PrivateKey(context.get(), key.get());
  }
  ERR_clear_error();
  return context;
}

// Returns null if the server does not answer.
Owned<BIO> Connect(const std::string& server) {
  Owned<BIO> bio(BIO_new_connect(server.c_str()));
  if (bio == nullptr || BIO_do_connect_retry(bio.get(), kTimeoutSeconds, 50) != 1) return nullptr;
  int fd = -1;
  BIO_get_fd(bio.get(), &fd);
  // BIO_do_connect_retry leaves the socket unchanged; bounds waiting from here on.
  BIO_socket_nbio(fd, 0);
  const timeval timeout = {kTimeoutSeconds, 0};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
  return bio;
}

std::string HostOf(const std::string& server, const ConnectionSecurity& security) {
  if (!security.server_name.empty()) return security.server_name;
  std::string host = server.substr(0, server.rfind(':'));
  if (host.size() > 2 && host.front() == '[') host = host.substr(1, host.size() - 2);
  return host;
}

void ExpectHost(SSL* ssl, const std::string& host) {
  unsigned char bytes[sizeof(in6_addr)];
  const bool is_ip =
      inet_pton(AF_INET, host.c_str(), bytes) == 1 || inet_pton(AF_INET6, host.c_str(), bytes) == 1;
  if (is_ip) {
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), host.c_str());
  } else {
    SSL_set1_host(ssl, host.c_str());
    SSL_set_tlsext_host_name(ssl, host.c_str());
  }
}

std::string ExplainVerification(long result, const ConnectionSecurity& security) {
  switch (result) {
    case X509_V_OK:
      return "";
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return "its certificate has expired; renew it, and check this machine's clock";
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return "its certificate is not valid yet; check the clocks";
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return "its certificate is for another name; use that name in --server, or pass it with "
             "--server-name";
    default:
      return security.authorities.empty()
                 ? "its certificate is signed by no authority that this system trusts; pass its "
                   "authority with --ca-cert"
                 : "its certificate is signed by no authority in the file of --ca-cert";
  }
}

// Returns false if the server answered the first message of the handshake in another protocol, or
// closed the connection.
bool AnsweredInTls(const SSL* ssl) {
  const int reason = ERR_GET_REASON(ERR_peek_error());
  if (reason == SSL_R_WRONG_VERSION_NUMBER) return false;
  const bool is_alert = reason >= SSL_AD_REASON_OFFSET;
  return is_alert || SSL_get_state(ssl) != TLS_ST_CW_CLNT_HELLO;
}

// Explains a refusal of our certificate by the server; empty if it was accepted. With TLS 1.3 the
// refusal arrives only after the handshake, in place of the first bytes.
std::string ExplainRefusal(SSL* ssl, const ConnectionSecurity& security) {
  char byte = 0;
  if (SSL_read(ssl, &byte, 1) > 0 || ERR_GET_LIB(ERR_peek_error()) != ERR_LIB_SSL) return "";
  return security.certificate.empty() ? "it requires a client certificate; pass --cert and --key"
                                      : "it rejects the client certificate (--cert), which may "
                                        "have expired, be signed by another authority, or belong "
                                        "to another --key";
}

}  // namespace

std::string DiagnoseTls(const std::string& server, const ConnectionSecurity& security) {
  if (server.find('/') != std::string::npos || server.rfind("unix:", 0) == 0) return "";
  if (const size_t comma = server.find(','); comma != std::string::npos) {
    return DiagnoseTls(server.substr(0, comma), security);
  }
  ERR_clear_error();
  const Owned<SSL_CTX> context = MakeContext(security);
  const Owned<SSL> ssl(SSL_new(context.get()));
  Owned<BIO> bio = Connect(server);
  if (bio == nullptr) return "";
  ERR_clear_error();
  static constexpr unsigned char kAlpn[] = {2, 'h', '2'};
  SSL_set_alpn_protos(ssl.get(), kAlpn, sizeof kAlpn);
  ExpectHost(ssl.get(), HostOf(server, security));
  BIO* const transport = bio.release();
  SSL_set_bio(ssl.get(), transport, transport);
  const bool shaken = SSL_connect(ssl.get()) == 1;
  if (!security.tls) return shaken ? "it requires TLS; pass --tls or --ca-cert" : "";
  if (!shaken) {
    return AnsweredInTls(ssl.get()) ? ExplainRefusal(ssl.get(), security)
                                    : "it does not use TLS; drop --tls and its options";
  }
  std::string reason = ExplainVerification(SSL_get_verify_result(ssl.get()), security);
  if (reason.empty()) reason = ExplainRefusal(ssl.get(), security);
  return reason;
}

}  // namespace hulld
