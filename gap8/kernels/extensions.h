/**
 * @file extensions.h
 * What the kernels use beyond C11, in one place. GCC and clang have it; with another compiler, or with
 * -DAIRTOUCH_PLAIN_C, plain C stands in its place. The results are the same to the last bit, only slower.
 */
#pragma once

#if defined(__GNUC__) && !defined(AIRTOUCH_PLAIN_C)

#define AIRTOUCH_GNU 1  // attributes, builtins and assembly of GCC and clang
#define ALWAYS_INLINE static inline __attribute__((always_inline))
#define LIKELY(condition) __builtin_expect((condition), 1)
#define ALIGNED_4(pointer) __builtin_assume_aligned((pointer), 4)

#else

#define AIRTOUCH_GNU 0
#define ALWAYS_INLINE static inline
#define LIKELY(condition) (condition)
#define ALIGNED_4(pointer) (pointer)

#endif

// GAP8's own compiler, a GCC 7, has the builtins of XPULP and defines __pulp__. A newer one that only
// defines __pulp__ is asked whether it has them.
#if !AIRTOUCH_GNU || !defined(__pulp__)
#define AIRTOUCH_PULP_BUILTINS 0
#elif !defined(__has_builtin)
#define AIRTOUCH_PULP_BUILTINS 1
#elif __has_builtin(__builtin_pulp_sdotsp4)
#define AIRTOUCH_PULP_BUILTINS 1
#else
#define AIRTOUCH_PULP_BUILTINS 0
#endif
