/* The floor: the square roots of all chords, nothing kept. The twin of floor() in chords.py. */
#include <math.h>

double floor_c(long count, const double *u, const double *v, const double *radius,
               double first, double spacing, long lines, double window)
{
    double sum = 0.0;
    for (long k = 0; k < count; k++) {
        long low = (long)ceil((v[k] - radius[k] - first) / spacing);
        long high = (long)floor((v[k] + radius[k] - first) / spacing) + 1;
        low = low > 0 ? low : 0;
        high = high < lines ? high : lines;
        for (long row = low; row < high; row++) {
            double y = first + row * spacing, dv = y - v[k];
            double reach2 = radius[k] * radius[k] - dv * dv, wide2 = window * window - y * y;
            double reach = sqrt(reach2 > 0 ? reach2 : 0), wide = sqrt(wide2 > 0 ? wide2 : 0);
            double left = u[k] - reach > -wide ? u[k] - reach : -wide;
            double right = u[k] + reach < wide ? u[k] + reach : wide;
            unsigned long from = (unsigned long)ceil((left - first) / spacing);
            unsigned long to = left < right ? (unsigned long)floor((right - first) / spacing) + 1 : 0;
            double part = 0.0;
            for (unsigned long i = from; i < to; i++) {
                double du = first - u[k] + spacing * (double)(long)i;
                double d2 = reach2 - du * du;
                part += sqrt(d2 > 0 ? d2 : 0);
            }
            sum += part;
        }
    }
    return sum;
}
