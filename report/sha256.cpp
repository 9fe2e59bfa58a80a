#include "report/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <memory>

#include "hal/error.h"

namespace emtb {
namespace {

class Digest {
 public:
  Digest() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    good_ = context_ && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1;
  }

  void add(std::string_view bytes) {
    good_ = good_ && EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1;
  }

  std::string in_hex() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> sum;
    unsigned length = 0;
    if (!good_ || EVP_DigestFinal_ex(context_.get(), sum.data(), &length) != 1)
      throw Error("OpenSSL makes no SHA-256 here");
    std::string hex;
    for (unsigned i = 0; i < length; ++i) {
      for (const int nibble : {sum[i] >> 4, sum[i] & 0xF}) hex += "0123456789abcdef"[nibble];
    }
    return hex;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
  bool good_ = false;
};

}  // namespace

std::string sha256(const std::filesystem::path& file) {
  Digest digest;
  std::ifstream in(file, std::ios::binary);
  std::array<char, 65536> block;
  while (in) {
    in.read(block.data(), block.size());
    digest.add({block.data(), static_cast<std::size_t>(in.gcount())});
  }
  if (!in.eof()) throw Error(file.string() + ": cannot be read");
  return digest.in_hex();
}

std::string sha256_of(std::string_view text) {
  Digest digest;
  digest.add(text);
  return digest.in_hex();
}

}  // namespace emtb
