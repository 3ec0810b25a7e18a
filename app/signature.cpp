#include "app/signature.h"

#include <array>
#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/crypto.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/objects.h>
#include <openssl/pem.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/script/command.h"

namespace app {
namespace {

constexpr std::size_t signature_bytes = script::signature_digits / 2;
constexpr std::size_t line_bytes = script::signature_start.size() + script::signature_digits + 1;
constexpr std::size_t largest_key = 65536;  // [bytes] of its file
constexpr std::string_view hex = "0123456789abcdef";

struct Free {
    void operator()(BIO* file) const { BIO_free(file); }
    void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
};
using Context = std::unique_ptr<EVP_MD_CTX, Free>;

/// Gives no password, and remembers that one was asked for.
int no_password(char*, int, int, void* asked) {
    *static_cast<bool*>(asked) = true;
    return -1;
}

using ReadPem = EVP_PKEY* (*)(BIO*, EVP_PKEY**, pem_password_cb*, void*);

/// `kind`: "private" or "public".
std::shared_ptr<EVP_PKEY> key_of(const std::filesystem::path& file, ReadPem read, std::string_view kind,
                                 const std::string& made_by) {
    std::string pem =
        io::read_text(file, "key", fmt::format("expected a {} key in PEM, as '{}' makes it", kind, made_by));
    const auto refuse = [&](const std::string& found) {
        throw io::InputError("{}: expected a {} Ed25519 key in PEM, as '{}' makes it; found {}",
                             file.string(), kind, made_by, found);
    };
    if (pem.size() > largest_key) refuse(fmt::format("a file of {} bytes", pem.size()));
    bool asked = false;
    const std::unique_ptr<BIO, Free> memory(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
    const std::shared_ptr<EVP_PKEY> key(read(memory.get(), nullptr, no_password, &asked), EVP_PKEY_free);
    ERR_clear_error();
    const bool is_public = pem.find("-----BEGIN PUBLIC KEY") != std::string::npos;
    const bool is_private = pem.find("PRIVATE KEY-----") != std::string::npos;
    OPENSSL_cleanse(pem.data(), pem.size());
    if (asked) {
        throw io::InputError(
            "{0}: the key is encrypted; expected one without a password, as 'openssl pkey -in {0} -out "
            "PLAIN.key' makes it",
            file.string());
    }
    if (!key) {
        refuse(is_public && kind == "private"   ? "a public key"
               : is_private && kind == "public" ? "a private key"
                                                : "none");
    }
    if (const int type = EVP_PKEY_base_id(key.get()); type != EVP_PKEY_ED25519) {
        const char* const name = OBJ_nid2ln(type);
        refuse(fmt::format("one of another algorithm ({})", name ? name : "unknown"));
    }
    return key;
}

[[noreturn]] void fail() {
    ERR_clear_error();
    throw io::InputError("OpenSSL cannot sign or check signatures by Ed25519 here, as of FIPS providers");
}

const unsigned char* bytes_of(std::string_view text) {
    return reinterpret_cast<const unsigned char*>(text.data());
}

/// The line that ends a signed recording; empty where its last line is no whole signature.
std::string_view signature_line(std::string_view recording) {
    if (recording.size() <= line_bytes) return {};
    const std::string_view line = recording.substr(recording.size() - line_bytes);
    const bool is_one = line.starts_with(script::signature_start) && line.ends_with('\n') &&
                        recording[recording.size() - line_bytes - 1] == '\n' &&
                        line.find_first_not_of(hex, script::signature_start.size()) == line_bytes - 1;
    return is_one ? line : std::string_view();
}

}  // namespace

SigningKey::SigningKey(const std::filesystem::path& file)
    : file_(file),
      key_(key_of(file, PEM_read_bio_PrivateKey, "private", "openssl genpkey -algorithm ed25519")) {}

void SigningKey::sign(const std::filesystem::path& file) const {
    const std::string text = io::read_text(file, "recording", "expected a recording (.gw)");
    if (!text.ends_with('\n') || !signature_line(text).empty())
        throw io::InputError("{}: cannot be signed: expected a recording without a signature", file.string());
    const Context context(EVP_MD_CTX_new());
    std::array<unsigned char, signature_bytes> signature;
    std::size_t size = signature.size();
    if (!context || EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key_.get()) != 1 ||
        EVP_DigestSign(context.get(), signature.data(), &size, bytes_of(text), text.size()) != 1 ||
        size != signature.size())
        fail();
    std::string line(script::signature_start);
    for (const unsigned char byte : signature) (line += hex[byte >> 4]) += hex[byte & 15];
    io::write_whole(file, text + line + "\n");
}

PublicKey::PublicKey(const std::filesystem::path& file)
    : key_(key_of(file, PEM_read_bio_PUBKEY, "public", "openssl pkey -in KEY -pubout")) {}

std::string PublicKey::distrust(std::string_view recording) const {
    const std::string_view line = signature_line(recording);
    if (line.empty())
        return recording.find("\nsignature ") == std::string_view::npos
                   ? "it has no signature"
                   : "its signature is damaged, or something was added after it";
    std::array<unsigned char, signature_bytes> signature;
    for (std::size_t k = 0; k < signature.size(); ++k) {
        const char* const digits = line.data() + script::signature_start.size() + 2 * k;
        signature[k] = static_cast<unsigned char>(hex.find(digits[0]) << 4 | hex.find(digits[1]));
    }
    const std::string_view content = recording.substr(0, recording.size() - line_bytes);
    const Context context(EVP_MD_CTX_new());
    if (!context || EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, key_.get()) != 1) fail();
    const int valid = EVP_DigestVerify(context.get(), signature.data(), signature.size(), bytes_of(content),
                                       content.size());
    ERR_clear_error();
    return valid == 1
               ? ""
               : "its signature does not fit: it was changed after it was signed, or signed with another key";
}

CLI::Option* add_sign(CLI::App* command, std::string& file) {
    return command
        ->add_option(
            "--sign", file,
            "Private Ed25519 key (.pem): signs each recording when it has ended, so that changes show "
            "(docs/privacy.md)")
        ->type_name("KEY");
}

void add_key(CLI::App* command, std::string& file, const char* otherwise) {
    command
        ->add_option("--key", file,
                     fmt::format("Public Ed25519 key (.pem) of who signs recordings: {}", otherwise))
        ->type_name("KEY");
}

}  // namespace app
