#include "report/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <memory>

#include "hal/error.h"

namespace emtb {

std::string sha256(const std::filesystem::path& file) {
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> digest(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  std::ifstream in(file, std::ios::binary);
  bool good = in.is_open() && digest && EVP_DigestInit_ex(digest.get(), EVP_sha256(), nullptr) == 1;
  std::array<char, 65536> block;
  while (good && in) {
    in.read(block.data(), block.size());
    good = EVP_DigestUpdate(digest.get(), block.data(), static_cast<std::size_t>(in.gcount())) == 1;
  }
  std::array<unsigned char, EVP_MAX_MD_SIZE> sum;
  unsigned length = 0;
  if (!good || in.bad() || EVP_DigestFinal_ex(digest.get(), sum.data(), &length) != 1)
    throw Error(file.string() + ": cannot be read");
  std::string hex;
  for (unsigned i = 0; i < length; ++i) {
    for (const int nibble : {sum[i] >> 4, sum[i] & 0xF}) hex += "0123456789abcdef"[nibble];
  }
  return hex;
}

}  // namespace emtb
