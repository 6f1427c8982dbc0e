// Whether this build runs under a sanitizer, which replaces malloc and is many times slower. gcc and clang define it in
// different ways.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FULCRUM_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define FULCRUM_SANITIZED 1
#endif
#endif
#ifndef FULCRUM_SANITIZED
#define FULCRUM_SANITIZED 0
#endif
