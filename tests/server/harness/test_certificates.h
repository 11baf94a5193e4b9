#ifndef HULLD_TESTS_SERVER_HARNESS_TEST_CERTIFICATES_H_
#define HULLD_TESTS_SERVER_HARNESS_TEST_CERTIFICATES_H_

#include <openssl/evp.h>
#include <openssl/x509.h>

#include <chrono>
#include <memory>
#include <string>

namespace hulld::server {

// A certificate and its private key, as PEM.
struct TestIdentity {
  std::string certificate;
  std::string key;
};

// Issues certificates for localhost and 127.0.0.1.
class TestAuthority {
 public:
  explicit TestAuthority(const std::string& name);

  // Its own certificate, for clients that trust it.
  const std::string& certificate() const { return certificate_pem_; }
  // Valid from now + `from` until now + `until`.
  TestIdentity Issue(const std::string& name, std::chrono::hours from = std::chrono::hours(-1),
                     std::chrono::hours until = std::chrono::hours(24)) const;

 private:
  std::shared_ptr<EVP_PKEY> key_;
  std::shared_ptr<X509> certificate_;
  std::string certificate_pem_;
};

// Replaces the file atomically, as certificate rotation should; readable by the owner only.
void WriteSecret(const std::string& path, const std::string& text);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_TEST_CERTIFICATES_H_
