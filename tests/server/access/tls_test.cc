// TLS: accepted and rejected clients, and reloading of changed files.

#include "server/access/tls.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "server/config_check.h"
#include "tests/server/harness/test_certificates.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace tls_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Tls : public ServerTest {
 protected:
  void SetUp() override {
    std::string pattern = ::testing::TempDir() + "/hulld_tls_test_XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    directory_ = pattern;
    identity_ = authority_.Issue("hulld");
    config_ = TestConfig();
    config_.tls_cert = Write("server.crt", identity_.certificate);
    config_.tls_key = Write("server.key", identity_.key);
  }

  ~Tls() override { std::filesystem::remove_all(directory_); }

  std::string Write(const std::string& name, const std::string& text) {
    const std::string path = directory_ + "/" + name;
    WriteSecret(path, text);
    return path;
  }

  // Returns the status of a call over a new connection.
  grpc::StatusCode Connect(std::shared_ptr<grpc::ChannelCredentials> credentials) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto stub = v1::StatusService::NewStub(
        grpc::CreateCustomChannel(server_->address(), credentials, arguments));
    return Call(*stub);
  }

  static grpc::StatusCode Call(v1::StatusService::Stub& stub) {
    grpc::ClientContext context;
    v1::GetStatusResponse response;
    return stub.GetStatus(&context, {}, &response).error_code();
  }

  static std::shared_ptr<grpc::ChannelCredentials> Trusting(const TestAuthority& authority,
                                                            const TestIdentity& self = {}) {
    return grpc::SslCredentials({authority.certificate(), self.key, self.certificate});
  }

  void ExpectWrong(const Config& config, const std::string& what) {
    const absl::Status status = LoadTlsIdentity(config).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << what;
    EXPECT_THAT(std::string(status.message()), HasSubstr(what));
    EXPECT_EQ(Server::Start(config).status(), status);
    EXPECT_EQ(CheckConfig(config, std::chrono::system_clock::now()).status(), status);
  }

  const TestAuthority authority_{"authority"};
  const TestAuthority other_{"other authority"};
  std::string directory_;
  TestIdentity identity_;
  Config config_;
};

TEST_F(Tls, OnlyClientsThatTrustTheAuthorityConnect) {
  Restart(config_);
  EXPECT_EQ(Connect(Trusting(authority_)), grpc::StatusCode::OK);
  EXPECT_EQ(Connect(Trusting(other_)), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(Connect(grpc::InsecureChannelCredentials()), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(Tls, MutualTlsRefusesClientsWithoutACertificateOfTheAuthority) {
  config_.tls_client_ca = Write("clients.crt", authority_.certificate());
  Restart(config_);
  EXPECT_EQ(Connect(Trusting(authority_, authority_.Issue("client"))), grpc::StatusCode::OK);
  EXPECT_EQ(Connect(Trusting(authority_)), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(Connect(Trusting(authority_, other_.Issue("client"))), grpc::StatusCode::UNAVAILABLE);
  const TestIdentity expired =
      authority_.Issue("client", std::chrono::hours(-2), std::chrono::hours(-1));
  EXPECT_EQ(Connect(Trusting(authority_, expired)), grpc::StatusCode::UNAVAILABLE);

  Write("clients.crt", other_.certificate());
  server_->ReloadFiles();
  EXPECT_EQ(Connect(Trusting(authority_, other_.Issue("client"))), grpc::StatusCode::OK);
  EXPECT_EQ(Connect(Trusting(authority_, authority_.Issue("client"))),
            grpc::StatusCode::UNAVAILABLE);
}

// Missing files count as revoked, like the last token.
TEST_F(Tls, WithoutAClientAuthorityAllConnectionsFail) {
  config_.tls_client_ca = Write("clients.crt", authority_.certificate());
  Restart(config_);
  const TestIdentity client = authority_.Issue("client");
  for (const bool is_removed : {false, true}) {
    SCOPED_TRACE(is_removed);
    ASSERT_EQ(Connect(Trusting(authority_, client)), grpc::StatusCode::OK);
    if (is_removed) {
      std::filesystem::remove(config_.tls_client_ca);
    } else {
      Write("clients.crt", "# nobody\n");
    }
    server_->ReloadFiles();
    EXPECT_EQ(Connect(Trusting(authority_, client)), grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(Connect(Trusting(authority_)), grpc::StatusCode::UNAVAILABLE);
    // A damaged file does not count as empty.
    Write("clients.crt", authority_.certificate().substr(0, 200));
    server_->ReloadFiles();
    EXPECT_EQ(Connect(Trusting(authority_, client)), grpc::StatusCode::UNAVAILABLE);
    Write("clients.crt", authority_.certificate());
    server_->ReloadFiles();
  }
  EXPECT_EQ(Connect(Trusting(authority_, client)), grpc::StatusCode::OK);
}

TEST_F(Tls, NewConnectionsUseReplacedCertificatesAndOldOnesStay) {
  Restart(config_);
  const auto standing =
      v1::StatusService::NewStub(grpc::CreateChannel(server_->address(), Trusting(authority_)));
  ASSERT_EQ(Call(*standing), grpc::StatusCode::OK);
  const TestIdentity renewed = other_.Issue("hulld");
  Write("server.crt", renewed.certificate);
  Write("server.key", renewed.key);
  server_->ReloadFiles();
  EXPECT_EQ(Connect(Trusting(other_)), grpc::StatusCode::OK);
  EXPECT_EQ(Connect(Trusting(authority_)), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(Call(*standing), grpc::StatusCode::OK);
}

TEST_F(Tls, AnIncompleteReplacementIsIgnored) {
  Restart(config_);
  const TestIdentity renewed = other_.Issue("hulld");
  Write("server.crt", renewed.certificate);
  server_->ReloadFiles();
  EXPECT_EQ(Connect(Trusting(authority_)), grpc::StatusCode::OK);
  Write("server.crt", renewed.certificate.substr(0, renewed.certificate.size() / 2));
  Write("server.key", renewed.key);
  server_->ReloadFiles();
  EXPECT_EQ(Connect(Trusting(authority_)), grpc::StatusCode::OK);
  std::filesystem::remove(config_.tls_key);
  server_->ReloadFiles();
  EXPECT_EQ(Connect(Trusting(authority_)), grpc::StatusCode::OK);

  Write("server.crt", renewed.certificate);
  Write("server.key", renewed.key);
  server_->ReloadFiles();
  EXPECT_EQ(Connect(Trusting(other_)), grpc::StatusCode::OK);
}

// Returns the version negotiated with a client that offers only `version`; empty if refused.
std::string HandshakeWith(int port, int version) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
  std::string name;
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    SSL_CTX* const context = SSL_CTX_new(TLS_client_method());
    SSL_CTX_set_min_proto_version(context, version);
    SSL_CTX_set_max_proto_version(context, version);
    // OpenSSL itself would not offer the old versions at its default level.
    SSL_CTX_set_cipher_list(context, "ALL:@SECLEVEL=0");
    SSL* const ssl = SSL_new(context);
    static constexpr unsigned char kAlpn[] = {2, 'h', '2'};
    SSL_set_alpn_protos(ssl, kAlpn, sizeof kAlpn);
    SSL_set_fd(ssl, fd);
    if (SSL_connect(ssl) == 1) name = SSL_get_version(ssl);
    SSL_free(ssl);
    SSL_CTX_free(context);
  }
  close(fd);
  return name;
}

TEST_F(Tls, VersionsBefore12AreRefused) {
  Restart(config_);
  const std::string address = server_->address();
  const int port = std::stoi(address.substr(address.rfind(':') + 1));
  EXPECT_EQ(HandshakeWith(port, TLS1_3_VERSION), "TLSv1.3");
  EXPECT_EQ(HandshakeWith(port, TLS1_2_VERSION), "TLSv1.2");
  EXPECT_EQ(HandshakeWith(port, TLS1_1_VERSION), "");
  EXPECT_EQ(HandshakeWith(port, TLS1_VERSION), "");
}

TEST_F(Tls, UnixSocketsWorkWithAndWithoutTls) {
  config_.listen = "unix:" + directory_ + "/tls.sock";
  Restart(config_);
  grpc::ChannelArguments arguments;
  arguments.SetSslTargetNameOverride("localhost");
  const auto stub = v1::StatusService::NewStub(
      grpc::CreateCustomChannel(server_->address(), Trusting(authority_), arguments));
  EXPECT_EQ(Call(*stub), grpc::StatusCode::OK);
}

TEST_F(Tls, ReachableAddressesNeedTls) {
  config_.listen = "0.0.0.0:0";
  EXPECT_TRUE(Server::Start(config_).ok());
  EXPECT_THAT(ExposureWarnings(config_), ::testing::ElementsAre(HasSubstr("--tokens-file")));
  config_.tls_cert.clear();
  config_.tls_key.clear();
  EXPECT_THAT(std::string(Server::Start(config_).status().message()), HasSubstr("--tls-cert"));
  config_.insecure = true;
  EXPECT_TRUE(Server::Start(config_).ok());
  EXPECT_EQ(ExposureWarnings(config_).size(), 2);
}

TEST_F(Tls, ErrorsNameTheSettingAndTheFile) {
  Config config = config_;
  config.tls_key.clear();
  ExpectWrong(config, "--tls-cert requires --tls-key");
  config = config_;
  config.tls_cert.clear();
  ExpectWrong(config, "--tls-key requires --tls-cert");
  config = TestConfig();
  config.tls_client_ca = config_.tls_cert;
  ExpectWrong(config, "--tls-client-ca requires --tls-cert");
  config = config_;
  config.tls_cert = directory_ + "/none";
  ExpectWrong(config, "--tls-cert " + config.tls_cert + ": No such file");
  config.tls_cert = directory_;
  ExpectWrong(config, "it is not a regular file");
  config.tls_cert = config_.tls_key;
  ExpectWrong(config, "it contains no PEM certificate");
  config.tls_cert = Write("cut.crt", identity_.certificate + identity_.certificate.substr(0, 300));
  ExpectWrong(config, "PEM certificate 2 is damaged");
  config = config_;
  config.tls_key = config_.tls_cert;
  ExpectWrong(config, "--tls-key " + config.tls_key + ": it contains no valid PEM private key");
  config.tls_key = Write("other.key", other_.Issue("hulld").key);
  ExpectWrong(config, "it does not belong to the first certificate of --tls-cert");
  config = config_;
  config.tls_client_ca = config_.tls_key;
  ExpectWrong(config, "--tls-client-ca " + config.tls_key + ": it contains no PEM certificate");
  config = config_;
  ASSERT_EQ(chmod(config.tls_key.c_str(), 0644), 0);
  ExpectWrong(config, "its permissions 0644 are too open");
}

TEST_F(Tls, AnInvalidCertificateIsReported) {
  const auto now = std::chrono::system_clock::now();
  EXPECT_TRUE(CheckConfig(config_, now).ok());
  const absl::Status expired = CheckConfig(config_, now + std::chrono::hours(48)).status();
  EXPECT_THAT(std::string(expired.message()), HasSubstr("expired on "));
  const absl::Status early = CheckConfig(config_, now - std::chrono::hours(48)).status();
  EXPECT_THAT(std::string(early.message()), HasSubstr("starts on "));
}

TEST_F(Tls, ADataDirectoryCanBeCreatedInAnExistingDirectory) {
  EXPECT_TRUE(CheckDataDir(directory_).ok());
  EXPECT_TRUE(CheckDataDir(directory_ + "/new/deeper").ok());
  EXPECT_TRUE(CheckDataDir("relative").ok());
  for (const char* name : {"/server.crt", "/server.crt/below"}) {
    EXPECT_THAT(std::string(CheckDataDir(directory_ + name).message()),
                AllOf(HasSubstr("--data-dir " + directory_), HasSubstr("is not a directory")));
  }
  if (geteuid() == 0) return;  // root may write everywhere
  EXPECT_THAT(std::string(CheckDataDir("/proc/new").message()), HasSubstr("cannot be written"));
}

}  // namespace tls_test
}  // namespace hulld::server
