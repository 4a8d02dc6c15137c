/* Solves the matrix written by against_cholmod.rs with CHOLMOD, ordered by METIS.
 * Arguments: file, rounds. Output: one line as against_cholmod.rs. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <suitesparse/cholmod.h>

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static void read_exactly(void *into, size_t size, size_t count, FILE *file) {
    if (fread(into, size, count, file) != count) {
        fprintf(stderr, "the matrix file is too short\n");
        exit(1);
    }
}

static double best_of(double best, double seconds) { return seconds < best ? seconds : best; }

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "arguments: matrix file, rounds\n");
        return 2;
    }
    FILE *file = fopen(argv[1], "rb");
    if (!file) {
        perror(argv[1]);
        return 1;
    }
    uint64_t size[2];
    read_exactly(size, sizeof size[0], 2, file);
    cholmod_common c;
    cholmod_start(&c);
    c.supernodal = CHOLMOD_SUPERNODAL;
    c.nmethods = 1;
    c.method[0].ordering = CHOLMOD_METIS;
    c.postorder = 1;
    cholmod_sparse *a = cholmod_allocate_sparse(size[0], size[0], size[1], 1, 1, -1, CHOLMOD_REAL, &c);
    read_exactly(a->p, sizeof(int32_t), size[0] + 1, file);
    read_exactly(a->i, sizeof(int32_t), size[1], file);
    read_exactly(a->x, sizeof(double), size[1], file);
    fclose(file);

    double best[4] = {1e300, 1e300, 1e300, 1e300}, entries = 0, residual = 0;
    for (int round = 0; round < atoi(argv[2]); round++) {
        cholmod_dense *one = cholmod_ones(a->nrow, 1, CHOLMOD_REAL, &c);
        cholmod_dense *many = cholmod_ones(a->nrow, 32, CHOLMOD_REAL, &c);
        double start = now();
        cholmod_factor *l = cholmod_analyze(a, &c);
        double analysed = now();
        cholmod_factorize(a, l, &c);
        double factored = now();
        cholmod_dense *x = cholmod_solve(CHOLMOD_A, l, one, &c);
        double solved = now();
        cholmod_dense *xs = cholmod_solve(CHOLMOD_A, l, many, &c);
        double done = now();
        best[0] = best_of(best[0], analysed - start);
        best[1] = best_of(best[1], factored - analysed);
        best[2] = best_of(best[2], solved - factored);
        best[3] = best_of(best[3], done - solved);
        entries = c.lnz;
        double alpha[2] = {1, 0}, beta[2] = {-1, 0};
        cholmod_sdmult(a, 0, alpha, beta, x, one, &c);
        residual = cholmod_norm_dense(one, 0, &c)
                   / (cholmod_norm_sparse(a, 0, &c) * cholmod_norm_dense(x, 0, &c) + 1);
        cholmod_free_dense(&x, &c);
        cholmod_free_dense(&xs, &c);
        cholmod_free_dense(&one, &c);
        cholmod_free_dense(&many, &c);
        cholmod_free_factor(&l, &c);
    }
    printf("cholmod %llu %.4f %.4f %.4f %.4f %.0f %.1e\n", (unsigned long long)(size[0] / 3), best[0], best[1],
           best[2], best[3], entries, residual);
    cholmod_free_sparse(&a, &c);
    cholmod_finish(&c);
    return 0;
}
