#pragma once
/// Signed recordings: the last line of one is "signature ed25519 HEX", by OpenSSL over all bytes before it.
/// What that proves is in docs/privacy.md.

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "app/arguments.h"

struct evp_pkey_st;  // OpenSSL's

namespace app {

/// What a teacher signs with.
class SigningKey {
public:
    /// Reads a private Ed25519 key in PEM. Throws InputError, as all below.
    explicit SigningKey(const std::filesystem::path&);
    /// Puts the signature at the end of a recording that has none.
    void sign(const std::filesystem::path&) const;
    const std::filesystem::path& file() const { return file_; }

private:
    std::filesystem::path file_;
    std::shared_ptr<evp_pkey_st> key_;
};

/// What a signature is checked by.
class PublicKey {
public:
    /// Reads a public Ed25519 key in PEM.
    explicit PublicKey(const std::filesystem::path&);
    /// Why the bytes of a recording do not count as signed by this key's other half; empty where they do.
    std::string distrust(std::string_view recording) const;

private:
    std::shared_ptr<evp_pkey_st> key_;
};

/// Adds --sign, of a command that makes recordings.
CLI::Option* add_sign(CLI::App*, std::string& file);
/// Adds --key, of a command that reads recordings; says what becomes of those without a valid signature.
void add_key(CLI::App*, std::string& file, const char* otherwise);

}  // namespace app
