/* A controller in C for nsspice: compile it to a shared library,
 *
 *     cc -shared -fPIC -O2 -I"$(nsspice --include)" -o law.so law.c
 *
 * and run   nsspice run deck.net --controller "law.so period=10u reads=v(out) writes=vduty"
 */
#ifndef NSSPICE_CONTROLLER_H
#define NSSPICE_CONTROLLER_H

#include <stddef.h>

#ifdef _WIN32
#define NSSPICE_EXPORT __declspec(dllexport)
#else
#define NSSPICE_EXPORT
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Called once a period.  in[k]: the k-th of reads [V or A].  out[k]: the k-th of writes; it holds
 * what was returned last (NaN at first), and a NaN leaves the source as it is. */
NSSPICE_EXPORT void step(const double *in, double *out, void *state);

/* Optional: the size of the state in bytes; it begins with zeros, 0 without this function. */
NSSPICE_EXPORT size_t state_size(void);

/* Optional: called before each run, to begin with other values than zeros. */
NSSPICE_EXPORT void start(void *state);

#ifdef __cplusplus
}
#endif

#endif
